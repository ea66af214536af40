import pytest

from reefmu.fmu.python_backend.workarounds import resource_folder


@pytest.mark.parametrize(
    ("location", "folder"),
    [
        ("file:///tmp/a%20b/%C3%BC", "/tmp/a b/ü"),
        ("file:///tmp/100%25", "/tmp/100%"),
        ("file://localhost/tmp/x", "/tmp/x"),
        ("file:/tmp/x", "/tmp/x"),
        ("FILE:///tmp/x", "/tmp/x"),
        ("file:///C:/fmus/a%23b/resources", "C:/fmus/a#b/resources"),
        ("file:///c%3A/fmus", "c:/fmus"),
        ("/C:/fmus", "C:/fmus"),
        ("C:/fmus", "C:/fmus"),
        ("file://server/share/x", "//server/share/x"),
        ("/no/such/a%20b", "/no/such/a b"),
        ("/plain/path", "/plain/path"),
    ],
)
def test_the_folder_that_a_host_names(location, folder):
    assert resource_folder(location).as_posix() == folder


def test_an_existing_path_with_a_percent_sign_is_not_decoded(tmp_path):
    (tmp_path / "a%20b").mkdir()
    assert resource_folder(str(tmp_path / "a%20b")) == tmp_path / "a%20b"
