"""Messages that lie to a scheduler and its workers: nothing of it has an effect."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from benchmarks.cluster_attack import KINDS, Attacker, Effects, attack
from benchmarks.cluster_processes import ShopCluster, make_certificates
from tests.host import amount

MESSAGES = amount(20 * len(KINDS), 10_000)


def test_malformed_and_foreign_messages_have_no_effect(
    own_cluster: ShopCluster, tmp_path: Path, record_property: Callable[[str, object], None]
) -> None:
    left = tmp_path / "left"
    left.mkdir()
    own_cluster.start_worker()
    own_cluster.wait_for(1)
    assert own_cluster.site.ca is not None
    others = make_certificates(tmp_path / "others")
    attacker = Attacker(left, own_cluster.site.ca.parent, others)
    effects: list[Effects] = []
    attack(own_cluster, attacker, MESSAGES, effects.append)
    assert {one.kind: one.found for one in effects} == dict.fromkeys(KINDS, ())
    assert sum(one.messages for one in effects) == MESSAGES
    # Announced sizes are not allocated; a process at its first task grows by its libraries.
    assert max(one.grown_mb for one in effects[1:]) < 300.0
    record_property("messages", f"{MESSAGES}, 0 effects")
    # The same request by an authorised client: it could have had an effect.
    attacker.run_program(own_cluster.port, "scheduler")
    assert attacker.markers == ["scheduler"]
