"""Running FMUs with `FmuDrive`, and the slave of the Python back end behind it."""

import logging
import math
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor

import fmpy
import numpy as np
import pytest

from reefmu.fmu.importer.instance import FmuDrive
from stiffness_model.errors import InputError, UnknownNameError

LOAD = {"crank.phi": 0.2, "output.phi": 0.2 / -29 - 1e-3}


@pytest.fixture
def slave(fmu):
    with FmuDrive(fmu) as opened:
        yield opened


def outputs_of(model, states, inputs):
    return np.asarray(model.output(states, inputs, model.parameter_vector())).ravel()


def test_start_and_step_follow_the_model(slave, model):
    parameters = model.parameter_vector()
    start = np.array([0.0, 0.0, 0.0, 0.0, 20.0])
    load = np.array([LOAD["crank.phi"], 0.0, LOAD["output.phi"], 0.0, 20.0])
    states = model.initial(start, parameters)
    outputs = slave.initialize()
    np.testing.assert_array_equal(list(outputs.values()), outputs_of(model, states, start))
    states = model.advance(states, load, 1 / 60, parameters)
    outputs = slave.step(1 / 60, LOAD)
    np.testing.assert_array_equal(list(outputs.values()), outputs_of(model, states, load))
    assert tuple(outputs) == slave.outputs
    assert outputs["output.tau"] > 10
    assert slave.time == 1 / 60


def test_inputs_keep_their_value(slave):
    slave.initialize(LOAD)
    first = slave.step(1e-3)
    assert slave.step(1e-3, LOAD) == pytest.approx(first)


def test_parameters_before_and_during_a_run(fmu):
    with FmuDrive(fmu) as mean, FmuDrive(fmu, parameters={"band": 1.0}) as high:
        low = mean.initialize(LOAD)["output.tau"]
        assert high.initialize(LOAD)["output.tau"] > low
        mean.set_parameters({"band": 1.0})
        assert mean.step(1e-3)["output.tau"] == pytest.approx(high.step(1e-3)["output.tau"])


def test_unknown_names_are_refused(slave, fmu):
    slave.initialize()
    with pytest.raises(UnknownNameError, match=r"unknown input 'crank\.fi'"):
        slave.step(1e-3, {"crank.fi": 0.0})
    with pytest.raises(UnknownNameError, match=r"unknown parameter 'bend'"):
        slave.set_parameters({"bend": 0.0})
    with pytest.raises(UnknownNameError, match=r"unknown variable"):
        slave.read(["torque"])
    with pytest.raises(UnknownNameError):
        FmuDrive(fmu, parameters={"bend": 0.0})


def test_reset_and_restore_repeat_a_run_exactly(slave):
    angles = np.sin(np.linspace(0, 9, 40)) * 0.05

    def run(part):
        return [slave.step(1e-3, {"crank.phi": angle}) for angle in part]

    slave.initialize()
    first = run(angles[:20])
    saved, time = slave.save(), slave.time
    rest = run(angles[20:])
    slave.restore(saved)
    assert slave.time == time
    assert run(angles[20:]) == rest
    slave.restore(saved)
    assert slave.step(1e-3) == slave.step(1e-3, {"crank.phi": angles[19]})  # the inputs were restored, too
    slave.reset()
    slave.initialize()
    assert run(angles[:20]) == first


def test_every_state_is_restored(slave, model):
    assert model.states
    names = [state.name for state in model.states]
    slave.initialize(LOAD)
    slave.step(0.01, {"crank.phi": 0.25})
    saved, before = slave.save(), slave.read(names)
    slave.step(0.01, {"crank.phi": -0.25})
    assert slave.read(names) != before
    slave.restore(saved)
    assert slave.read(names) == before


def test_a_foreign_state_is_refused(fmu, soft_fmu):
    with FmuDrive(fmu) as slave, FmuDrive(soft_fmu) as soft:
        slave.initialize()
        soft.initialize()
        with pytest.raises(InputError, match="expected a state of FMU"):
            slave.restore(soft.save())
    with FmuDrive(fmu) as slave, pytest.raises(InputError, match="expected a state of FMU"):
        slave.restore(bytes(20))
    with FmuDrive(fmu) as slave, pytest.raises(InputError, match="expected a state from save"):
        slave.restore(b"")


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_value_that_is_not_a_number_is_discarded_and_changes_nothing(fmu, value):
    with FmuDrive(fmu) as slave, FmuDrive(fmu) as untouched:
        slave.initialize()
        untouched.initialize()
        with pytest.raises(InputError, match=r"discard.*crank\.phi: expected a finite number"):
            slave.step(1e-3, {"crank.phi": value})
        assert slave.step(1e-3, LOAD) == untouched.step(1e-3, LOAD)


def test_a_value_that_is_not_a_number_at_the_start_gives_no_result(slave):
    outputs = slave.initialize({"crank.phi": math.nan})
    assert all(math.isnan(value) for value in outputs.values())
    with pytest.raises(InputError, match=r"crank\.phi: expected a finite number"):
        slave.step(1e-3)
    assert math.isfinite(slave.step(1e-3, LOAD)["output.tau"])


def test_the_message_reaches_the_log_of_python(slave, caplog):
    slave.initialize()
    with caplog.at_level(logging.ERROR, "reefmu.fmu"), pytest.raises(InputError):
        slave.step(1e-3, {"crank.phi": math.nan})
    assert "crank.phi: expected a finite number" in caplog.text


@pytest.mark.parametrize("dt", [0.0, -1e-3, math.nan, math.inf])
def test_a_step_must_be_above_zero(slave, dt):
    before = slave.initialize(LOAD)
    with pytest.raises(InputError, match="expected a communication step above 0 s"):
        slave.step(dt)
    assert slave.read() == before


@pytest.mark.parametrize("dt", [1 / 60, 1e-6, 1e-3 / 3, 3600.0])
def test_steps_of_any_length(fmu, dt):
    """Inputs are constant over a step, so one step and seven of a seventh give the same result."""
    with FmuDrive(fmu) as whole, FmuDrive(fmu) as parts:
        whole.initialize()
        parts.initialize()
        for angle in (0.05, -0.03, 0.04):
            expected = whole.step(dt, {"crank.phi": angle})
            for _ in range(7):
                came = parts.step(dt / 7, {"crank.phi": angle})
            assert came == pytest.approx(expected, rel=1e-12)
        assert parts.time == pytest.approx(whole.time)


def test_parameters_out_of_range_are_refused(fmu, slave):
    with pytest.raises(InputError, match="band: expected a number from -1 to 1"):
        FmuDrive(fmu, parameters={"band": 2.0})
    slave.initialize()
    with pytest.raises(InputError, match="band: expected a number from -1 to 1"):
        slave.set_parameters({"band": -2.0})
    slave.set_parameters({"band": -1.0})
    slave.step(1e-3)


def test_a_fixed_parameter_cannot_be_set_in_a_run(slave, model):
    fixed = next(p.name for p in model.parameters if not p.tunable)
    slave.initialize()
    with pytest.raises(InputError, match=f"may be set now .*{fixed}"):
        slave.set_parameters({fixed: 1.0})
    with pytest.raises(InputError, match="closed or has failed"):
        slave.step(1e-3)


def test_a_step_before_the_start_is_discarded(slave):
    with pytest.raises(InputError, match="between initialisation and termination"):
        slave.step(1e-3)


def test_drives_in_one_process_do_not_mix(fmu, soft_fmu, model, soft_model):
    with FmuDrive(fmu) as stiff, FmuDrive(soft_fmu) as soft, FmuDrive(fmu) as second:
        torques = [slave.initialize(LOAD)["output.tau"] for slave in (stiff, soft, second)]
        assert torques[0] > 5 * torques[1] > 0
        assert torques[0] == torques[2]
        assert stiff.step(1e-3, {"crank.phi": 0.21}) != second.step(1e-3)
    for file, torque in ((soft_fmu, torques[1]), (fmu, torques[0])):  # in reverse order, with the libraries reloaded
        with FmuDrive(file) as slave:
            assert slave.initialize(LOAD)["output.tau"] == torque


def test_instances_in_threads(fmu):
    angles = np.sin(np.linspace(0, 20, 300)) * 0.05

    def run(scale):
        with FmuDrive(fmu) as slave:
            slave.initialize()
            return [slave.step(1e-3, {"crank.phi": scale * angle})["output.tau"] for angle in angles]

    scales = [1.0, 0.5, -1.0, 0.25]
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(run, scales)) == [run(scale) for scale in scales]


def test_a_second_start_needs_a_reset(slave):
    slave.initialize()
    with pytest.raises(InputError, match="reset"):
        slave.initialize()
    slave.reset()
    slave.initialize()


def test_many_successive_instances_of_one_fmu(fmu):
    results = []
    for _ in range(25):
        with FmuDrive(fmu) as slave:
            slave.initialize()
            results.append(slave.step(1e-3, LOAD)["output.tau"])
    assert len(set(results)) == 1


@pytest.mark.parametrize("folder", ["plain", "with blank", "ümlaut", "ü and blank", "100%", "hash#tag"])
def test_any_temporary_folder(fmu, folder, tmp_path, monkeypatch):
    (tmp_path / folder).mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / folder))
    with FmuDrive(fmu) as slave:
        slave.initialize()
        slave.step(1e-3)
    assert list((tmp_path / folder).iterdir()) == []


def test_a_temporary_folder_that_pythonfmu_cannot_read(fmu, tmp_path, monkeypatch):
    (tmp_path / "a%20b").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "a%20b"))
    with pytest.raises(InputError, match="without '%20' in its name"):
        FmuDrive(fmu)


def test_closing_removes_the_unpacked_files(fmu, tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    path = list(sys.path)
    slave = FmuDrive(fmu)
    assert list(tmp_path.iterdir())
    slave.close()
    slave.close()
    assert list(tmp_path.iterdir()) == []
    assert sys.path == path
    with pytest.raises(InputError, match="closed"):
        slave.initialize()


def test_an_instance_that_was_not_closed_is_removed_with_its_folder(fmu, tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    slave = FmuDrive(fmu)
    slave.initialize()
    del slave
    assert list(tmp_path.iterdir()) == []


def test_fmpys_own_simulation_runs_it(fmu):
    signals = np.array([(0.0, 0.0), (0.5, 0.05), (1.0, -0.05)], dtype=[("time", float), ("crank.phi", float)])
    with FmuDrive(fmu):  # the first library stays in the process, and only this package finalises it
        result = fmpy.simulate_fmu(
            str(fmu),
            stop_time=1.0,
            output_interval=1 / 60,
            input=signals,
            start_values={"band": 0.5},
            output=["output.tau", "twist"],
        )
    assert len(result) == 61
    assert np.isfinite(result["output.tau"]).all()
    assert np.ptp(result["output.tau"]) > 10


def test_an_illegal_call_is_fatal_but_does_not_end_the_process(fmu):
    code = f"""
import gc
from fmpy.fmi1 import FMICallException
from reefmu.fmu.importer.instance import FmuDrive
for call in (lambda f: f.getReal([999]), lambda f: f.setReal([999], [1.0]), lambda f: f.setReal([5], [1.0]),
             lambda f: f.getInteger([0]), lambda f: f.setBoolean([0], [1])):
    slave = FmuDrive({str(fmu)!r})
    slave.initialize()
    for _ in range(3):
        try:
            call(slave._loaded.fmu)
        except FMICallException as error:
            assert error.status == 4, error.status
        else:
            raise SystemExit("not refused")
    slave.close()
    gc.collect()
print("alive")
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.returncode, done.stdout.strip()) == (0, "alive"), done.stderr
