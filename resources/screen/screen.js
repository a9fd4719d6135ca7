// Shows the snapshots of the station (docs/second_screen.schema.json); decides nothing itself.
"use strict";
const GONE_MS = 800, RETRY_MS = 500;
const at = (id) => document.getElementById(id);
const token = location.hash.slice(1) || sessionStorage.getItem("token") || "";
sessionStorage.setItem("token", token);
history.replaceState(null, "", location.pathname + location.search);
const wanted = new URLSearchParams(location.search).get("language") || navigator.language;
const language = wanted.slice(0, 2).toLowerCase();
let socket = null, texts = {}, job = null, live = null, heard = 0, busy = 0, count = 0, answer = [];
let code = 0, pictured = "", mayControl = false, current = false;

function text(element, words) {
  if (element.textContent !== words) element.textContent = words;
}

function word(element, said) {
  element.dataset.code = said.code;
  text(element, said.text);
}

function made(tag, words, kind) {
  const element = document.createElement(tag);
  element.textContent = words;
  if (kind) element.className = kind;
  return element;
}

function marked(said) {
  const element = made("span", said.text, "word");
  element.dataset.code = said.code;
  return element;
}

function numbers(result) {
  const names = ["measured", "deviation", "uncertainty", "limits"];
  return (result.valued ? names : names.slice(3)).flatMap((name) =>
    [made("dt", `${texts[name]} ${result.unit}`), made("dd", result[name])]);
}

function showJob() {
  document.body.dataset.sequence = job.sequence;
  const part = job.shown === "";
  const feature = job.features.find((one) => one.name === job.shown);
  const result = job.results.find((one) => one.name === job.deciding);
  text(at("feature"), part ? "" : `${feature.name}  ${feature.count}`);
  word(at("verdict"), part ? job.part : feature.verdict);
  at("verdict").classList.toggle("large", part);
  at("numbers").replaceChildren(...(part || !result || !result.valued ? [] : numbers(result)));
  at("far").classList.toggle("part", part);
  text(at("reason"), job.reason);
  text(at("next"), job.next);
  text(at("instruction"), job.instruction);
  at("features").replaceChildren(...job.features.map((one) => {
    const row = made("li", ""), said = one.state.code === "done" ? one.verdict : one.state;
    row.classList.toggle("active", one.state.code === "active");
    row.append(made("b", one.name), made("span", `${one.shape}  ${one.count}`, "muted"),
      marked(said));
    return row;
  }));
  at("list").replaceChildren(...job.results.map((one) => {
    const row = made("li", ""), list = made("dl", "");
    list.append(...numbers(one));
    row.append(made("b", one.name), marked(one.verdict),
      made("span", `${one.kind} · ${one.features.join(", ")}`, "muted"), list);
    if (one.reason) row.append(made("p", one.reason, "reason"));
    return row;
  }));
  showPicture();
}

async function showPicture() {
  const key = job.picture && `${job.job}\n${job.picture}`;
  if (key === pictured) return;
  pictured = key;
  const image = at("picture");
  image.hidden = true;
  if (image.src) URL.revokeObjectURL(image.src);
  if (!key) return;
  const answered = await fetch(`picture?feature=${encodeURIComponent(job.picture)}`,
    {headers: {Authorization: `Bearer ${token}`}}).catch(() => null);
  if (!answered || !answered.ok || key !== pictured) return;
  image.src = URL.createObjectURL(await answered.blob());
  image.alt = texts.picture;
  image.hidden = false;
}

function showLive() {
  word(at("status"), live.status);
  text(at("distance"), live.distance);
  const [x, y, z] = live.position, u = `${texts.uncertainty} ${live.uncertainty} mm`;
  at("position").replaceChildren(...[`X ${x}`, `Y ${y}`, `Z ${z}`, u].map((one) => made("span", one)));
  text(at("title"), !current ? texts.old : job ? job.title : "");
  document.body.classList.toggle("old", !current);
}

function showNotes() {
  const notes = [];
  if (live.reason) notes.push(["warn", live.reason]);
  if (job && job.paused) notes.push(["warn", job.paused]);
  if (job && job.refusal.length) notes.push(["bad", ...job.refusal]);
  if (answer.length) notes.push(["bad", ...answer]);
  for (const fault of live.faults) notes.push(["warn", fault]);
  for (const state of job ? job.states : []) notes.push(["state", state]);
  const shown = JSON.stringify(notes), section = at("notes");
  if (section.dataset.shown === shown) return;
  section.dataset.shown = shown;
  section.replaceChildren(...notes.map(([kind, what, remedy]) => {
    const note = made("p", what, kind);
    if (remedy) note.append(" ", made("b", remedy));
    return note;
  }));
}

function showButtons() {
  at("buttons").hidden = !mayControl;
  at("take").disabled = busy || !job;
  at("undo").disabled = busy || !job || !job.undo || !current;
  at("finish").disabled = busy || !job || !job.can_finish || !current;
  text(at("undo").lastChild, job ? job.undo : "");
}

function show(snapshot) {
  heard = performance.now();
  if (snapshot.number === 1) {
    texts = snapshot.texts;
    document.documentElement.lang = texts.language;
    for (const [id, name] of [["tab-far", "far"], ["tab-plan", "plan"], ["tab-results", "results"],
      ["take", "take"], ["finish", "finish"]]) text(at(id), texts[name]);
    text(at("undo").firstChild, texts.undo);
    busy = 0;
  }
  mayControl = snapshot.controls;
  live = snapshot.live;
  current = snapshot.current;
  for (const one of snapshot.answers) if (one.id === busy) {
    busy = 0;
    answer = [one.what, one.remedy].filter(Boolean);
  }
  if (snapshot.job) {
    job = snapshot.job;
    showJob();
  }
  showLive();
  showNotes();
  showButtons();
  at("gone").hidden = true;
}

function connect() {
  const mine = socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${
    location.host}/live`);
  mine.onopen = () => mine.send(JSON.stringify({token, language}));
  mine.onmessage = (message) => {
    const snapshot = JSON.parse(message.data);
    show(snapshot);
    mine.send(JSON.stringify({seen: snapshot.number}));
  };
  mine.onclose = (end) => {
    code = end.code;
    heard = -Infinity;
    setTimeout(connect, code >= 4000 ? 10 * RETRY_MS : RETRY_MS);
  };
}

function watch() {
  if (performance.now() - heard <= GONE_MS) return;
  const [what, remedy] = at("gone").children;
  if (texts.gone) text(what, code === 4001 ? texts.wrong : code === 4029 ? texts.full : texts.gone);
  else if (code === 4001) text(what, "Scan the code again. Code neu scannen.");
  text(remedy, texts.gone_remedy || "");
  at("gone").hidden = false;
}

function act(what) {
  busy = ++count;
  answer = [];
  showButtons();
  socket.send(JSON.stringify({do: what, id: busy, job: job.job, sequence: job.sequence}));
}

for (const what of ["take", "undo", "finish"]) at(what).onclick = () => act(what);
for (const tab of document.querySelectorAll("nav button")) tab.onclick = () => {
  for (const one of document.querySelectorAll("nav button")) {
    one.setAttribute("aria-pressed", String(one === tab));
    at(one.dataset.page).hidden = one !== tab;
  }
};
setInterval(watch, 100);
connect();
