"""The certificates by which a Dask cluster and this machine know each other.

Whoever reaches a scheduler runs code on its workers, and whoever stands in for it on this machine: a message of Dask is a pickle. With an
address tls://host:port both sides show a certificate, and each asks that one authority has signed it. The name of the host is not
compared, so that the authority must be the cluster's own: with any other, whoever gets a certificate from it is let in.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from daebench.errors import BadInput

OPTIONS = ("--tls-ca-file", "--tls-cert", "--tls-key")


@dataclass(frozen=True)
class Tls:
    """Files of certificates, in PEM."""

    ca_file: Path | None = None
    """Certificate of the cluster's own authority."""
    cert: Path | None = None
    """Certificate by which this machine is known."""
    key: Path | None = None
    """Its key; by default in the same file."""

    def __post_init__(self) -> None:
        if not self:
            return
        if self.ca_file is None or self.cert is None:
            raise BadInput("--tls-ca-file and --tls-cert belong together: by one the cluster is known, by the other this machine.")
        for option, path in zip(OPTIONS, (self.ca_file, self.cert, self.key), strict=True):
            if path is not None and not path.is_file():
                raise BadInput(f"{option} {path}: there is no such file.")

    def __bool__(self) -> bool:
        """Return whether any file is given."""
        return any(path is not None for path in (self.ca_file, self.cert, self.key))


NO_TLS = Tls()
"""No files of certificates."""


def security(address: str, tls: Tls) -> Any:
    """Return the ``security`` of Dask's client: None for an address without encryption.

    Where no files are given, they are those that Dask's own configuration names, ``distributed.comm.tls``. BadInput is raised if there are
    certificates for an address without encryption, none for one with it, or they cannot be used.
    """
    if not address.startswith("tls://"):
        if tls:
            raise BadInput(f"{address} is without encryption, and certificates are given; its address must be tls://host:port.")
        return None
    from distributed import Security

    files = {"tls_ca_file": tls.ca_file, "tls_client_cert": tls.cert, "tls_client_key": tls.key or tls.cert} if tls else {}
    try:
        settings = Security(require_encryption=True, **{name: str(path) for name, path in files.items()})
        ready = settings.get_connection_args("client").get("ssl_context") is not None
    except (OSError, ValueError) as error:  # those of ssl are OSError too
        raise BadInput(f"the certificates for {address} cannot be used ({error}); give files in PEM that belong together.") from error
    if not ready:
        raise BadInput(f"{address} takes certificates; give --tls-ca-file, --tls-cert and --tls-key, or set Dask's distributed.comm.tls.")
    return settings
