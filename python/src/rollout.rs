//! Many worlds at once: open-loop trajectories, one world a thread.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use numpy::ndarray::{ArrayD, IxDyn};
use numpy::{PyArrayDyn, PyReadonlyArrayDyn};
use penny::forward::Method;
use penny::math::Vec6;
use penny::model::Model;
use penny::state::State;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use rayon::prelude::*;

use crate::data::Core;
use crate::model::MjModel;

/// mjtState: what a control may hold.
const CTRL: u32 = 1 << 6;
const QFRC: u32 = 1 << 7;
const XFRC: u32 = 1 << 8;
const EQ_ACTIVE: u32 = 1 << 9;
const MOCAP_POS: u32 = 1 << 10;
const MOCAP_QUAT: u32 = 1 << 11;

/// Numbers of time, qpos, qvel, act.
fn full(m: &Model) -> usize {
    1 + m.nq + m.nv + m.na
}

fn put(state: &mut State, m: &Model, row: &[f64]) {
    state.time = row[0];
    let (qpos, rest) = row[1..].split_at(m.nq);
    let (qvel, act) = rest.split_at(m.nv);
    state.qpos.copy_from_slice(qpos);
    state.qvel.copy_from_slice(qvel);
    state.act.copy_from_slice(act);
}

fn take(state: &State, row: &mut [f64]) {
    row[0] = state.time;
    let numbers = state.qpos.iter().chain(&state.qvel).chain(&state.act);
    row[1..].iter_mut().zip(numbers).for_each(|(to, from)| *to = *from);
}

/// How many numbers each part of a control has, in MuJoCo's order.
fn parts(m: &Model, spec: u32) -> impl Iterator<Item = (u32, usize)> {
    let all = [
        (CTRL, m.actuators.len()),
        (QFRC, m.nv),
        (XFRC, 6 * m.bodies.len()),
        (EQ_ACTIVE, m.equalities.len()),
        (MOCAP_POS, 3 * m.mocap.len()),
        (MOCAP_QUAT, 4 * m.mocap.len()),
    ];
    all.into_iter().filter(move |(bit, _)| spec & bit != 0)
}

fn control(state: &mut State, m: &Model, spec: u32, mut row: &[f64]) {
    for (bit, n) in parts(m, spec) {
        let (now, rest) = row.split_at(n);
        row = rest;
        match bit {
            CTRL => state.ctrl.copy_from_slice(now),
            QFRC => state.qfrc_applied = now.to_vec(),
            XFRC => state.xfrc_applied = now.chunks_exact(6).map(Vec6::from_column_slice).collect(),
            EQ_ACTIVE => state.eq_active.iter_mut().zip(now).for_each(|(to, from)| *to = *from != 0.0),
            MOCAP_POS => state.mocap_pos.as_flattened_mut().copy_from_slice(now),
            _ => state.mocap_quat.as_flattened_mut().copy_from_slice(now),
        }
    }
}

/// One world's trajectory.
struct World<'a> {
    model: Arc<Model>,
    method: Method,
    start: &'a [f64],
    warm: Option<&'a [f64]>,
    /// (nstep, ncontrol), or nothing.
    controls: &'a [f64],
    states: &'a mut [f64],
    sensors: &'a mut [f64],
}

/// Between two looks at Ctrl-C.
const LOOK_EVERY: Duration = Duration::from_millis(50);
/// Steps between two looks at whether to stop.
const LOOK: usize = 64;

impl World<'_> {
    /// Out: why it stopped, and after how many steps; its last state then fills the rest.
    fn run(self, spec: u32, nstep: usize, stop: &AtomicBool) -> Option<(usize, String)> {
        let World { model, method, start, warm, controls, states, sensors } = self;
        let (nstate, nsensor) = (full(&model), model.nsensordata);
        let mut core = Core::new(model, method);
        put(&mut core.state, &core.model, start);
        if let Some(warm) = warm {
            core.state.qacc_warmstart.copy_from_slice(warm);
        }
        let ncontrol = controls.len() / nstep.max(1);
        let mut failed = None;
        for t in 0..nstep {
            if failed.is_none() {
                if t % LOOK == 0 && stop.load(Ordering::Relaxed) {
                    return None;
                }
                if ncontrol > 0 {
                    control(&mut core.state, &core.model, spec, &controls[t * ncontrol..(t + 1) * ncontrol]);
                }
                failed = core.step(1).err().map(|why| (t, why.to_string()));
            }
            take(&core.state, &mut states[t * nstate..(t + 1) * nstate]);
            sensors[t * nsensor..(t + 1) * nsensor].copy_from_slice(&core.data.sensordata);
        }
        failed
    }
}

/// A world that stopped: its number, the step, why.
type Stopped = (usize, usize, String);
type Table<'py> = Bound<'py, PyArrayDyn<f64>>;

/// Trajectories of many worlds under open-loop controls; the same bits on any number of threads.
///
/// In: models, one for all worlds or one for each; `initial` (nbatch, nstate), `controls` (nbatch, nstep, ncontrol),
/// `warm` (nbatch, nv); threads, 0 for rayon's own. Out: states (nbatch, nstep, nstate), sensor values (nbatch, nstep,
/// nsensordata), and the worlds that stopped before their end.
#[pyfunction]
#[pyo3(signature = (models, initial, controls, warm, spec, nstep, threads))]
#[allow(clippy::too_many_arguments)]
pub fn _rollout<'py>(
    py: Python<'py>,
    models: Vec<Bound<'py, MjModel>>,
    initial: PyReadonlyArrayDyn<'py, f64>,
    controls: Option<PyReadonlyArrayDyn<'py, f64>>,
    warm: Option<PyReadonlyArrayDyn<'py, f64>>,
    spec: u32,
    nstep: usize,
    threads: usize,
) -> PyResult<(Table<'py>, Table<'py>, Vec<Stopped>)> {
    let known = CTRL | QFRC | XFRC | EQ_ACTIVE | MOCAP_POS | MOCAP_QUAT;
    if spec & !known != 0 {
        return Err(PyValueError::new_err(format!("control_spec {spec:#x}: Penny has no such controls")));
    }
    let mut list = Vec::new();
    for model in &models {
        let mut model = model.borrow_mut();
        model.sync(py)?;
        list.push((model.model.clone(), model.method));
    }
    let Some((first, _)) = list.first().cloned() else { return Err(PyValueError::new_err("no model")) };
    let (nstate, nsensor, nv) = (full(&first), first.nsensordata, first.nv);
    let ncontrol: usize = parts(&first, spec).map(|(_, n)| n).sum();
    let starts: Vec<f64> = initial.as_array().iter().copied().collect();
    let nbatch = starts.len() / nstate;
    let given =
        |of: &Option<PyReadonlyArrayDyn<f64>>| of.as_ref().map(|a| a.as_array().iter().copied().collect::<Vec<f64>>());
    let (controls, warm) = (given(&controls), given(&warm));
    let fits = |of: &Option<Vec<f64>>, n: usize| of.as_ref().is_none_or(|v| v.len() == n);
    let alike = |m: &Model| (full(m), m.nsensordata, m.nv) == (nstate, nsensor, nv);
    if starts.len() != nbatch * nstate || !fits(&controls, nbatch * nstep * ncontrol) || !fits(&warm, nbatch * nv) {
        return Err(PyTypeError::new_err("shapes of initial states, controls and warm starts do not fit the model"));
    }
    if !(list.len() == 1 || list.len() == nbatch) || !list.iter().all(|(m, _)| alike(m)) {
        return Err(PyTypeError::new_err("models: one, or one for each world, all of the same sizes"));
    }
    let (mut states, mut sensors) = (vec![0.0; nbatch * nstep * nstate], vec![0.0; nbatch * nstep * nsensor]);
    let stop = AtomicBool::new(false);
    let work = |stop: &AtomicBool, states: &mut [f64], sensors: &mut [f64]| {
        // A width of zero has no chunks.
        let mut sensors = sensors.chunks_mut((nstep * nsensor).max(1));
        let worlds = states.chunks_mut((nstep * nstate).max(1)).enumerate().map(|(i, states)| {
            let (model, method) = list[i % list.len()].clone();
            World {
                model,
                method,
                start: &starts[i * nstate..(i + 1) * nstate],
                warm: warm.as_ref().map(|w| &w[i * nv..(i + 1) * nv]),
                controls: controls.as_ref().map_or(&[], |c| &c[i * nstep * ncontrol..(i + 1) * nstep * ncontrol]),
                states,
                sensors: sensors.next().unwrap_or_default(),
            }
        });
        let worlds: Vec<World> = worlds.collect();
        let run = |(i, world): (usize, World)| world.run(spec, nstep, stop).map(|(t, why)| (i, t, why));
        worlds.into_par_iter().enumerate().filter_map(run).collect::<Vec<Stopped>>()
    };
    let pool = match threads {
        0 => None,
        n => {
            let built = rayon::ThreadPoolBuilder::new().num_threads(n).build();
            Some(built.map_err(|why| PyValueError::new_err(why.to_string()))?)
        }
    };
    let stopped = watched(py, &stop, || {
        let mut run = || work(&stop, &mut states, &mut sensors);
        match &pool {
            Some(pool) => pool.install(run),
            None => run(),
        }
    })?;
    let table = |values: Vec<f64>, n: usize| {
        let array = ArrayD::from_shape_vec(IxDyn(&[nbatch, nstep, n]), values);
        array.map(|a| PyArrayDyn::from_owned_array(py, a)).map_err(|e| PyValueError::new_err(e.to_string()))
    };
    Ok((table(states, nstate)?, table(sensors, nsensor)?, stopped))
}

/// Runs work without Python's lock on a thread of its own, and looks for Ctrl-C in between.
///
/// Errors: whatever the signal raises; `stop` is set and the work waited for.
fn watched<T: Send>(py: Python, stop: &AtomicBool, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    std::thread::scope(|scope| {
        let (done, finished) = channel();
        let worker = scope.spawn(move || {
            let result = work();
            // Nobody waits any more where this fails.
            let _ = done.send(());
            result
        });
        let finished = Mutex::new(finished);
        let wait = || finished.lock().ok().map(|finished| finished.recv_timeout(LOOK_EVERY));
        let mut interrupted = Ok(());
        while let Some(Err(RecvTimeoutError::Timeout)) = py.detach(wait) {
            if interrupted.is_ok() {
                interrupted = py.check_signals();
                stop.store(interrupted.is_err(), Ordering::Relaxed);
            }
        }
        let result = worker.join().map_err(|_| PyValueError::new_err("a thread panicked"))?;
        interrupted.map(|()| result)
    })
}
