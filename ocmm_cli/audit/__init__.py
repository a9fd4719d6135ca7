"""``ocmm audit`` and ``ocmm key``: integrity, signers and trusted keys.

In: a job, a folder of records, the seal of a report; a public key. Out: sentences, and exit codes.

See `_audit` (verify, release, adopt; keys of this station and of others). Judgement is in
`export.audits` and `seals`.
"""

from ocmm_core.door import TYPE_CHECKING, door

if TYPE_CHECKING:
    from ocmm_cli.audit._audit import audit_app, key_app
else:
    __getattr__ = door(__name__)

__all__ = ["audit_app", "key_app"]
