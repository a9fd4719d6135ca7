"""Certificates of the machine: verifications, calibrations of cameras, qualified tips.

In: sealed records, also of acceptance tests, or an artefact's certificate.
Out: a signed Digital Calibration Certificate (DCC 3.2.1), an artefact document.

Read `_content` (data of a certificate, its head, and the list of clauses), `_from_records` (also of
acceptance tests) and `_from_calibration` (sources), `_dcc` (the XML), `_seal` (signatures),
`_reader` (any DCC), `_artefact` (a certificate of a bar or a sphere becomes its document). It must
not judge: errors, limits and verdicts are those of the records. `ocmm_gui.reports` draws the PDF.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.export.certificate._artefact import (
        Expansion, artefact_fields, artefact_text, quantities_read,
    )  # fmt: skip
    from ocmm_core.export.certificate._content import (
        Certificate, CertificateLine, CertificateRun, CertificateValue, Conformity, air_said,
        certificate_facts, certificate_title, rule_said,
    )  # fmt: skip
    from ocmm_core.export.certificate._from_calibration import certificate_of_calibration
    from ocmm_core.export.certificate._from_records import (
        certificate_of_cameras, certificate_of_folder, certificate_of_tip,
    )  # fmt: skip
    from ocmm_core.export.certificate._reader import Dcc, DccQuantity, read_dcc
    from ocmm_core.export.certificate._seal import (
        CERTIFICATE_ENDING, SEAL_SUFFIX, check_dcc_seal, signed_certificates, write_certificate,
        write_certificates,
    )  # fmt: skip
    from ocmm_core.export.certificate._xml_signature import (
        TrustedSigners, XmlSignature, XmlSignatureWord, trust_laboratory, trusted_signers,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "CERTIFICATE_ENDING", "SEAL_SUFFIX", "Certificate", "CertificateLine", "CertificateRun",
    "CertificateValue", "Conformity", "Dcc", "DccQuantity", "Expansion", "TrustedSigners",
    "XmlSignature", "XmlSignatureWord", "air_said", "artefact_fields", "artefact_text",
    "certificate_facts", "certificate_of_calibration", "certificate_of_cameras",
    "certificate_of_folder", "certificate_of_tip", "certificate_title", "check_dcc_seal",
    "quantities_read", "read_dcc", "rule_said", "signed_certificates", "trust_laboratory",
    "trusted_signers", "write_certificate", "write_certificates",
]  # fmt: skip
