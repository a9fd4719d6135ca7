"""Certificate as a Digital Calibration Certificate (PTB DCC 3.2.1 with D-SI 2.1.0).

Numbers are written with all their digits (`repr`). Every error has its U, k and coverage
probability, its limit, and its conformity in the words of the schema: CONFORM is ``pass``, NOT
CONFORM ``fail``, NOT PROVEN ``conditionalPass`` or ``conditionalFail``. Unknown data are "not
stated"; the required country is then the user-assigned code ``ZZ``.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from lxml import etree

from ocmm_core.build import build_version
from ocmm_core.calibration.records import ArtefactUse
from ocmm_core.errors import InternalError, StorageError
from ocmm_core.export.certificate import _content as content
from ocmm_core.export.report import NOT_STATED, one_line

DCC, SI = "https://ptb.de/dcc", "https://ptb.de/si"
VERSION = "3.2.1"
_NO_COUNTRY = "ZZ"
_COVERAGE = "0.95"
_MM = "\\milli\\metre"
_SHA256 = "SHA-256"


def dcc_tree(paper: content.Certificate) -> etree._Element:
    """Return a certificate as a DCC without signature; StorageError if a number is not finite."""
    root = etree.Element(f"{{{DCC}}}digitalCalibrationCertificate", nsmap={"dcc": DCC, "si": SI})
    root.set("schemaVersion", VERSION)
    _administrative(_add(root, "administrativeData"), paper)
    results = _add(root, "measurementResults")
    for run in paper.runs:
        _run(_add(results, "measurementResult"), paper, run)
    if paper.values_before:
        _values(_add(results, "measurementResult"), paper, paper.values_before, "beforeAdjustment")
    if paper.values:
        status: content.Status | None = "afterAdjustment" if paper.values_before else None
        _values(_add(results, "measurementResult"), paper, paper.values, status)
    if not (paper.runs or paper.values or paper.values_before):
        raise InternalError("certificate.empty", f"{paper.number} states nothing.", "Report this.")
    etree.indent(root)
    return root


def _administrative(parent: etree._Element, paper: content.Certificate) -> None:
    house, given = paper.paper.template.laboratory, paper.paper.given
    software = _add(_add(parent, "dccSoftware"), "software")
    _text(software, "name", "OCMM")
    _add(software, "release", build_version())
    core = _add(parent, "coreData")
    _add(core, "countryCodeISO3166_1", house.country or _NO_COUNTRY)
    _add(core, "usedLangCodeISO639_1", "en")
    _add(core, "mandatoryLangCodeISO639_1", "en")
    _add(core, "uniqueIdentifier", paper.number)
    _add(core, "beginPerformanceDate", paper.begin_utc[:10])
    _add(core, "endPerformanceDate", paper.end_utc[:10])
    _add(core, "performanceLocation", "other")
    if paper.previous:
        _hash(_add(core, "previousReport"), "Record before", paper.previous[:16], paper.previous)
    item = _add(_add(parent, "items"), "item")
    _text(item, "name", paper.item)
    machine = paper.paper.template.machine
    _text(_add(item, "manufacturer"), "name", machine.name or NOT_STATED)
    marks = _add(item, "identifications")
    for name, value in paper.identifications:
        mark = _add(marks, "identification")
        _add(mark, "issuer", "other")
        _add(mark, "value", value)
        _text(mark, "name", name)
    laboratory = _add(parent, "calibrationLaboratory")
    if paper.accreditation:
        _add(laboratory, "calibrationLaboratoryCode", paper.accreditation)
    _contact(_add(laboratory, "contact"), house.name, house.contact, ", ".join(house.address))
    persons = _add(parent, "respPersons")
    people = dict.fromkeys(run.made_by for run in reversed(paper.runs))
    for index, who in enumerate(people or {NOT_STATED: None}):
        person = _add(persons, "respPerson")
        _text(_add(person, "person"), "name", who)
        _add(person, "role", "carried out the test")
        _add(person, "mainSigner", "true" if index == 0 else "false")
    _contact(_add(parent, "customer"), given.customer or house.name, "", given.customer_address)
    statements = _add(parent, "statements")
    for fact in content.certificate_facts(paper):
        statement = _add(statements, "statement")
        if fact.clause:
            _add(statement, "norm", f"ISO/IEC 17025:2017, {fact.clause}")
        _rich(statement, "declaration", f"{fact.name}: {fact.value}")
    final = paper.final
    overall = _add(statements, "statement")
    _rich(overall, "declaration", content.conformity_words(paper) or "No statement of conformity.")
    _add(overall, "conformity", final.word if final is not None else "noPass")


def _run(parent: etree._Element, paper: content.Certificate, run: content.CertificateRun) -> None:
    _text(parent, "name", f"{paper.item}, {content.STATUS_WORDS[run.status]}")
    _rich(parent, "description", f"Judged by: {run.rule}.")
    _methods(parent, paper)
    if paper.artefacts:
        equipments = _add(parent, "measuringEquipments")
        for use in paper.artefacts:
            _equipment(_add(equipments, "measuringEquipment"), use)
    conditions = _add(parent, "influenceConditions")
    condition = _add(conditions, "influenceCondition", refType="basic_temperature")
    _text(condition, "name", "Temperature of the surroundings")
    _add(condition, "status", run.status)
    data = _add(condition, "data")
    if run.temperature_c is None:
        _rich(data, "text", NOT_STATED)
    else:
        _real(_add(data, "quantity"), "Temperature", run.temperature_c, "\\degreeCelsius")
    for name, value, unit in (
        ("Relative humidity", run.air.humidity_percent, "\\percent"),
        ("Air pressure", run.air.pressure_hpa, "\\hecto\\pascal"),
    ):
        if value is not None:
            read = _add(conditions, "influenceCondition")
            _text(read, "name", name)
            _add(read, "status", run.status)
            _real(_add(_add(read, "data"), "quantity"), name, value, unit)
    results = _add(parent, "results")
    for line in run.lines:
        _line(_add(results, "result"), line)
    if not run.lines:
        empty = _add(results, "result")
        _text(empty, "name", "No result")
        _rich(_add(empty, "data"), "text", "The record holds no result.")
    meta = _add(_add(parent, "measurementMetaData"), "metaData")
    _rich(meta, "declaration", f"Made {run.made_utc} by {run.made_by}. " + " ".join(run.notes))
    _add(meta, "conformity", run.word)
    behind = _add(parent[-1], "metaData")
    _add(behind, "reference", f"record {_SHA256} {run.record}")
    _add(behind, "reference", f"observations {_SHA256} {run.data_sha256}")


def _line(parent: etree._Element, line: content.CertificateLine) -> None:
    _text(parent, "name", line.name)
    data = _add(parent, "data")
    measured = _add(data, "quantity", refType="basic_measuredValue")
    _real(measured, "measured", line.measured, _MM)
    certified = _add(data, "quantity", refType="basic_referenceValue")
    _real(certified, "certified", line.reference, _MM)
    error = _add(data, "quantity", refType="basic_measurementError")
    _real(error, "error", line.error, _MM, line.expanded)
    meta = _add(_add(error, "measurementMetaData"), "metaData")
    if line.stated is None:
        _add(meta, "norm", "ISO 14253-1")
    _add(meta, "conformity", line.conformity.value)
    limit = _add(_add(meta, "data"), "quantity", refType="basic_acceptanceLimit")
    _real(limit, "maximum permissible error", line.limit, _MM)


def _values(
    parent: etree._Element,
    paper: content.Certificate,
    values: Sequence[content.CertificateValue],
    status: content.Status | None,
) -> None:
    state = "" if status is None else f", {content.STATUS_WORDS[status]}"
    _text(parent, "name", f"{paper.item}, further values{state}")
    _methods(parent, paper)
    if status is not None:
        condition = _add(_add(parent, "influenceConditions"), "influenceCondition")
        _text(condition, "name", "State of the item")
        _add(condition, "status", status)
        _rich(_add(condition, "data"), "text", content.STATUS_WORDS[status])
    results = _add(parent, "results")
    for value in values:
        _value(_add(results, "result"), value)


def _value(parent: etree._Element, value: content.CertificateValue) -> None:
    _text(parent, "name", value.name)
    quantity = _add(_add(parent, "data"), "quantity")
    _real(quantity, value.name, value.value, value.unit, value.expanded)


def _methods(parent: etree._Element, paper: content.Certificate) -> None:
    method = _add(_add(parent, "usedMethods"), "usedMethod")
    _text(method, "name", paper.method)
    for norm in paper.norms:
        _add(method, "norm", norm)


def _equipment(parent: etree._Element, use: ArtefactUse) -> None:
    _text(parent, "name", use.name)
    if use.certificate_sha256:
        _hash(_add(parent, "certificate"), "Certificate", use.certificate, use.certificate_sha256)
    marks = _add(parent, "identifications")
    for name, value in _marks(use):
        mark = _add(marks, "identification")
        _add(mark, "issuer", "other")
        _add(mark, "value", value)
        _text(mark, "name", name)


def _marks(use: ArtefactUse) -> Iterator[tuple[str, str]]:
    yield "serial number", use.serial or NOT_STATED
    yield "certificate", use.certificate or NOT_STATED
    yield "due", use.due_utc[:10] or NOT_STATED


def _contact(parent: etree._Element, name: str, mail: str, where: str) -> None:
    _text(parent, "name", name or NOT_STATED)
    _add(parent, "eMail", mail or NOT_STATED)
    _rich(_add(parent, "location"), "further", where or NOT_STATED)


def _hash(parent: etree._Element, what: str, number: str, digest: str) -> None:
    _text(parent, "referral", what)
    _add(parent, "referralID", number or NOT_STATED)
    _add(parent, "procedure", _SHA256)
    _add(parent, "value", digest)


def _real(
    parent: etree._Element, label: str, value: float, unit: str, expanded: float | None = None
) -> None:  # fmt: skip
    _text(parent, "name", label)
    real = etree.SubElement(parent, f"{{{SI}}}real")
    for name, told in (("label", _plain(label)), ("value", _number(label, value)), ("unit", unit)):
        etree.SubElement(real, f"{{{SI}}}{name}").text = told
    if expanded is None:
        return
    unc = etree.SubElement(real, f"{{{SI}}}expandedUnc")
    for name, told in (
        ("uncertainty", _number(label, expanded)),
        ("coverageFactor", _number(label, content.K)),
        ("coverageProbability", _COVERAGE),
    ):
        etree.SubElement(unc, f"{{{SI}}}{name}").text = told


def _number(name: str, value: float) -> str:
    if not abs(value) < float("inf"):
        raise StorageError(
            "certificate.number",
            f"{name} is {value}, which is no number for a certificate.",
            "Repeat the test; send the record to the maintainers of this program.",
        )
    return repr(float(value))


def _add(
    parent: etree._Element, name: str, text: str | None = None, **attributes: str
) -> etree._Element:
    node = etree.SubElement(parent, f"{{{DCC}}}{name}", attributes)
    if text is not None:
        node.text = _plain(text)
    return node


def _text(parent: etree._Element, name: str, text: str) -> None:
    _language(_add(_add(parent, name), "content", text))


def _rich(parent: etree._Element, name: str, text: str) -> None:
    _language(_add(_add(parent, name), "content", text))


def _language(node: etree._Element) -> None:
    node.set("lang", "en")


def _plain(text: str) -> str:
    """Return a text as allowed by the schema: on one line, and not empty."""
    return one_line(text) or NOT_STATED
