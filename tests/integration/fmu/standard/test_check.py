import json
import re
import zipfile

import pytest

from reefmu.cli import main
from reefmu.fmu.importer import instance as host
from reefmu.fmu.validation import run_checks
from reefmu.fmu.validation.fmu_check import check_fmu, embedded_component
from reefmu.fmu.xml.archive import read_archive
from stiffness_model.errors import InputError

NAMES = ["standard", "declaration", "agreement", "reset", "restore", "refusal", "independence", "parameters", "replay"]


def test_an_export_passes(fmu, soft_fmu):
    for path in (fmu, soft_fmu):
        report = check_fmu(path)
        assert report.passed, str(report)
        assert [result.name for result in report.results] == NAMES
        assert report["agreement"].value <= 1e-9
        assert str(path) in str(report)


def test_the_results_as_json(fmu, capsys):
    assert main(["check", str(fmu), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["passed"]
    assert [result["name"] for result in found["results"]] == NAMES
    assert found["results"][2]["value"] <= found["results"][2]["limit"]


def test_a_wrong_torque_is_found(fmu, monkeypatch):
    from reefmu.fmu.model.kernel import StepKernel

    right = StepKernel.step

    def wrong(self, dt):
        done = right(self, dt)
        self._y[0] *= 1 + 1e-7
        return done

    monkeypatch.setattr(StepKernel, "step", wrong)
    report = check_fmu(fmu)
    assert not report.passed
    assert not report["agreement"].passed
    assert "output.tau" in report["agreement"].detail
    assert report["standard"].passed
    assert "FAIL agreement" in str(report)


def test_a_state_that_is_not_restored_is_found(fmu, monkeypatch):
    from reefmu.fmu.python_backend.slave import DriveSlave

    monkeypatch.setattr(DriveSlave, "_set_fmu_state", lambda self, state: None)
    report = check_fmu(fmu)
    assert not report["restore"].passed
    assert report["agreement"].passed


def test_instances_that_share_their_values_are_found(fmu, monkeypatch):
    from reefmu.fmu.model.kernel import StepKernel

    made = {}
    monkeypatch.setattr(
        "reefmu.fmu.python_backend.slave.StepKernel", lambda *args: made.setdefault("one", StepKernel(*args))
    )
    assert not check_fmu(fmu)["independence"].passed


def test_an_accepted_nan_is_found(fmu, monkeypatch):
    monkeypatch.setattr(host.FmuDrive, "_set_inputs", lambda self, inputs: None)
    monkeypatch.setattr(
        run_checks, "run_fmu", lambda drive, excitation, names: [drive.initialize() and [0.0] * len(names)]
    )
    with host.FmuDrive(fmu) as drive:
        excitation = run_checks.make_excitation(embedded_component(read_archive(fmu)))
        assert not run_checks.check_discard(drive, excitation, ("output.tau",), excitation.inputs[:, :1]).passed


def test_a_model_that_was_exchanged_after_the_export_is_found(rewritten):
    def stiffer(name, content):
        return content.replace(b"5e-06 rad/", b"4e-06 rad/") if name.endswith(".toml") else content

    report = check_fmu(rewritten(stiffer))
    assert not report["declaration"].passed
    assert "structural_compliance" in report["declaration"].detail


def test_an_invalid_description_is_found(rewritten):
    def without_structure(name, content):
        return content.replace(b"<InitialUnknowns>", b"<InitialUnknown>") if name.endswith(".xml") else content

    with pytest.raises(InputError, match=r"expected XML in modelDescription\.xml"):
        check_fmu(rewritten(without_structure))

    def wrong_unit(name, content):
        return content.replace(b'<Unit name="N">', b'<Unit name="kN">') if name.endswith(".xml") else content

    report = check_fmu(rewritten(wrong_unit))
    assert not report["standard"].passed
    assert "unit" in report["standard"].detail


def test_missing_file_and_folder(tmp_path):
    with pytest.raises(InputError, match=r"absent\.fmu: expected an FMU file, got 'no such file'"):
        check_fmu(tmp_path / "absent.fmu")
    with pytest.raises(InputError, match="expected an FMU file, got 'a folder'"):
        check_fmu(tmp_path)


@pytest.mark.parametrize("content", [b"", b"not a zip archive at all", b"PK\x03\x04" + bytes(100)])
def test_a_file_that_is_not_a_zip_archive(content, tmp_path):
    path = tmp_path / "no.fmu"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"no\.fmu: expected an FMU \(a whole zip archive\)"):
        check_fmu(path)


@pytest.mark.parametrize("part", [0.1, 0.5, 0.99])
def test_a_truncated_fmu(fmu, part, tmp_path):
    path = tmp_path / "cut.fmu"
    content = fmu.read_bytes()
    path.write_bytes(content[: int(part * len(content))])
    with pytest.raises(InputError, match=r"cut\.fmu: expected an FMU \(a whole zip archive\)"):
        check_fmu(path)


def test_a_damaged_fmu(fmu, tmp_path):
    path = tmp_path / "damaged.fmu"
    content = bytearray(fmu.read_bytes())
    middle = len(content) // 2
    content[middle : middle + 50] = bytes(50)
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"damaged\.fmu: expected"):
        check_fmu(path)


def test_a_foreign_fmu(tmp_path):
    path = tmp_path / "foreign.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(
            "modelDescription.xml",
            '<fmiModelDescription fmiVersion="2.0" modelName="x" guid="g" generationTool="Other 1">'
            '<CoSimulation modelIdentifier="x"/></fmiModelDescription>',
        )
    with pytest.raises(InputError, match=r"of kind drive or joint that reefmu exported, got 'one by Other 1'"):
        check_fmu(path)
    with pytest.raises(InputError, match="expected an FMU that runs here"):
        host.FmuDrive(path)


def test_a_zip_archive_of_something_else(tmp_path):
    path = tmp_path / "other.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("readme.txt", "hello")
    with pytest.raises(InputError, match=r"expected an FMU with modelDescription\.xml"):
        check_fmu(path)


@pytest.mark.parametrize("member", ["resources/model.toml", "resources/lookup.npz"])
def test_resources_missing_or_damaged(rewritten, member):
    with pytest.raises(InputError, match=f"expected {member} in the FMU"):
        check_fmu(rewritten(lambda name, content: None if name == member else content))
    with pytest.raises(InputError) as refused:
        check_fmu(rewritten(lambda name, content: b"\x00nonsense" if name == member else content))
    assert "\n" not in str(refused.value)


def test_a_missing_script(rewritten):
    """pythonfmu would end the process in this case."""
    path = rewritten(lambda name, content: None if name.endswith(".py") else content)
    with pytest.raises(InputError, match="expected the script"):
        check_fmu(path)
    path = rewritten(lambda name, content: None if name.endswith("slavemodule.txt") else content)
    with pytest.raises(InputError, match="expected the script"):
        check_fmu(path)


def test_no_binary_for_this_machine(rewritten):
    path = rewritten(lambda name, content: None if name.startswith("binaries/") else content)
    with pytest.raises(InputError, match="expected an FMU that runs here"):
        check_fmu(path)


def test_an_unstable_step_is_reported_with_the_greatest_stable_one(soft_fmu, capsys):
    def check(*words):
        status = main(["check", str(soft_fmu), *words])
        output = capsys.readouterr()
        return status, output.out, output.err

    status, out, _ = check("--inertia", "0.08", "--step", "1e-3")
    assert status == 1
    limit = float(re.search(r"FAIL coupling: 0.001 \(at most (\S+)\)", out)[1])
    assert 1e-7 < limit < 1e-3
    assert "stays stable at any step" in out
    assert check("--inertia", "0.08", "--step", str(0.99 * limit))[0] == 0
    assert check("--inertia", "0.08", "--step", str(1.01 * limit))[0] == 1
    assert check("--inertia", str(0.08 * 1e4), "--step", str(1e4 * limit))[0] == 0  # limit ~ inertia/stiffness
    for words, message in (
        (("--step", "1"), "expected --inertia beside --step"),
        (("--inertia", "-1"), "--inertia: expected a positive inertia"),
        (("--inertia", "1", "--step", "nan"), "--step: expected a positive communication step"),
    ):
        status, _, err = check(*words)
        assert status == 2
        assert message in err
