"""A Dask cluster behind TLS: who shows a certificate of its authority gets in, and nobody else."""

import shutil
import subprocess

import pytest
from refusals import refused, require_refusals

from daebench.cli.executors import Executors
from daebench.studies.grid.schedulers import OPTIONS, Tls, dask_cluster, security

distributed = pytest.importorskip("distributed", reason="the extra scale is not installed")

pytestmark = pytest.mark.skipif(shutil.which("openssl") is None, reason="there is no openssl to make certificates with")


def authority(folder):
    """Make an authority and a certificate that it has signed; return the three files."""
    folder.mkdir()

    def openssl(*words):
        subprocess.run(["openssl", *words], cwd=folder, check=True, capture_output=True)

    new = ("-newkey", "rsa:2048", "-nodes")
    openssl("req", "-x509", *new, "-keyout", "ca.key", "-out", "ca.pem", "-subj", "/CN=authority", "-days", "2")
    openssl("req", *new, "-keyout", "own.key", "-out", "own.csr", "-subj", "/CN=member")
    openssl("x509", "-req", "-in", "own.csr", "-CA", "ca.pem", "-CAkey", "ca.key", "-CAcreateserial", "-out", "own.pem", "-days", "2")
    (folder / "both.pem").write_text((folder / "own.pem").read_text() + (folder / "own.key").read_text())
    return Tls(folder / "ca.pem", folder / "own.pem", folder / "own.key")


@pytest.fixture(scope="module")
def certificates(tmp_path_factory):
    return authority(tmp_path_factory.mktemp("tls") / "own")


@pytest.fixture(scope="module")
def foreign(tmp_path_factory):
    return authority(tmp_path_factory.mktemp("tls") / "foreign")


def configured(ca_file, cert, key):
    """Have Dask's configuration name these files, or none."""
    import dask

    tls = {"ca-file": ca_file, "client.cert": cert, "client.key": key}
    return dask.config.set({f"distributed.comm.tls.{name}": path and str(path) for name, path in tls.items()})


@pytest.fixture
def no_configuration():
    with configured(None, None, None):
        yield


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::DeprecationWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_cluster_behind_tls_lets_in_its_own_and_nobody_else(certificates, foreign, no_configuration, monkeypatch):
    monkeypatch.setattr("daebench.studies.grid.schedulers.REACHED_SECONDS", 20.0)
    ca_file, cert, key = certificates.ca_file, certificates.cert, certificates.key
    served = {f"tls_{who}_{what}": str(path) for who in ("scheduler", "worker", "client") for what, path in (("cert", cert), ("key", key))}
    safe = distributed.Security(require_encryption=True, tls_ca_file=str(ca_file), **served)
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=":0", protocol="tls", security=safe) as cluster:
        address = cluster.scheduler_address
        assert address.startswith("tls://")
        for own in (certificates, Tls(ca_file, cert.with_name("both.pem"))):
            with dask_cluster(address, own) as executor:
                assert executor.submit(pow, 2, 5).result(timeout=60) == 32
        with configured(ca_file, cert, key), dask_cluster(address) as executor:
            assert executor.submit(pow, 2, 6).result(timeout=60) == 64
        monkeypatch.setattr("daebench.studies.grid.schedulers.REACHED_SECONDS", 3.0)
        strangers = [foreign, Tls(foreign.ca_file, cert, key), Tls(ca_file, foreign.cert, foreign.key)]
        for where, each in [*((address, each) for each in strangers), (address.replace("tls://", "tcp://"), Tls())]:
            with refused("no-dask-scheduler"), dask_cluster(where, each):
                pass


def test_what_is_given_is_what_dask_is_given(certificates, no_configuration):
    found = security("tls://a:1", certificates)
    assert found.require_encryption
    assert found.tls_ca_file == str(certificates.ca_file)
    assert (found.tls_client_cert, found.tls_client_key) == (str(certificates.cert), str(certificates.key))
    assert security("tcp://a:1", Tls()) is None


def test_what_does_not_belong_together_is_a_sentence(certificates, foreign, no_configuration, tmp_path):
    ca_file, cert, key = certificates.ca_file, certificates.cert, certificates.key
    (tmp_path / "empty.pem").touch()
    for files in ({"ca_file": ca_file}, {"cert": cert}, {"key": key}, {"cert": cert, "key": key}, {"ca_file": ca_file, "key": key}):
        with refused("tls-files-incomplete"):
            Tls(**files)
    for files in ((tmp_path / "no.pem", cert, key), (ca_file, tmp_path, key), (ca_file, cert, tmp_path / "no.key")):
        with refused("no-such-tls-file"):
            Tls(*files)
    for files in ((ca_file, cert, foreign.key), (tmp_path / "empty.pem", cert, key), (ca_file, ca_file), (key, cert, key), (ca_file, cert)):
        with refused("tls-certificates-unusable"):
            security("tls://a:1", Tls(*files))
    for address in ("tcp://a:1", "a:1", "tls:a:1"):
        with refused("scheduler-not-encrypted", says=("host:port",)):
            security(address, certificates)
    with refused("scheduler-needs-certificates", says=("tls://a:1",)):
        security("tls://a:1", Tls())
    with refused("tls-without-scheduler"):
        Executors(timed=False, tls=certificates)


def test_a_command_takes_certificates_and_says_what_tcp_means(daebench, certificates, tmp_path, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    text = daebench("stability", "--help")[1]
    assert all(said in text for said in (*OPTIONS, "any code"))
    given = [word for pair in zip(OPTIONS, (certificates.ca_file, certificates.cert, certificates.key), strict=True) for word in pair]
    words = ("stability", "planar_pendulum", *given, "--out", tmp_path)
    require_refusals(daebench, words, ("scheduler-not-encrypted", "--scheduler tcp://127.0.0.1:1"))
