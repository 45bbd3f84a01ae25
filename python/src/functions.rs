//! MuJoCo's functions on models and data.

use numpy::AllowTypeChange;
use numpy::{PyArrayDyn, PyArrayLikeDyn, PyArrayMethods, PyUntypedArrayMethods};
use penny::dynamics::{self, spatial};
use penny::integrate;
use penny::math::{Quat, Vec3, Vec6, quat, vec3, wxyz};
use penny::model::{JointKind, Model};
use penny::quantities;
use penny::state::State;
use pyo3::exceptions::{PyIndexError, PyNotImplementedError, PyTypeError, PyValueError};
use pyo3::prelude::*;

use crate::callback::control;
use crate::data::{Core, MjData, step_error};
use crate::model::MjModel;
use crate::values::fill;

/// An array that a function writes its result into.
pub struct Out<'py, T: numpy::Element = f64>(Bound<'py, PyArrayDyn<T>>);

impl<'py, T: numpy::Element> FromPyObject<'_, 'py> for Out<'py, T> {
    type Error = PyErr;

    /// Errors: `TypeError` that says what kind of array it has to be; NumPy's own calls one array no instance of the other.
    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        given.cast::<PyArrayDyn<T>>().map(|array| Out(array.to_owned())).map_err(|_| {
            let right = numpy::dtype::<T>(given.py());
            let is = match given.getattr("dtype") {
                Ok(dtype) => format!("an array of {dtype}"),
                Err(_) => given.get_type().to_string(),
            };
            PyTypeError::new_err(format!("the result is written into a NumPy array of {right}, which {is} is not"))
        })
    }
}

impl<'py, T: numpy::Element> std::ops::Deref for Out<'py, T> {
    type Target = Bound<'py, PyArrayDyn<T>>;

    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

type Real<'py> = Out<'py>;
type Given<'py> = PyArrayLikeDyn<'py, f64, AllowTypeChange>;

/// This many numbers, whatever the shape.
///
/// Errors: `TypeError` if there are more or fewer.
fn numbers(name: &str, given: &Given, n: usize) -> PyResult<Vec<f64>> {
    let values: Vec<f64> = given.as_array().iter().copied().collect();
    if values.len() == n {
        Ok(values)
    } else {
        Err(PyTypeError::new_err(format!("{name} should have {n} numbers, not {}", values.len())))
    }
}

fn index(what: &str, i: isize, n: usize) -> PyResult<usize> {
    let found = usize::try_from(i).ok().filter(|i| *i < n);
    found.ok_or_else(|| PyIndexError::new_err(format!("{what} {i}: there are {n}")))
}

/// Steps times bodies from which on Python's lock is given back. Giving it back and taking it again takes 70 ns, a step of a
/// body 30 ns and more: so it costs 1 % at most.
const WORK: usize = 200;
/// Steps in one go without the lock.
const CHUNK: usize = 20_000;

/// Advances by `nstep` timesteps.
///
/// Errors: `penny.StepError` where the run diverges; `d` then holds what the failed step left.
#[pyfunction]
#[pyo3(signature = (m, d, nstep=1))]
pub fn mj_step(py: Python, m: &Bound<MjModel>, d: &Bound<MjData>, nstep: usize) -> PyResult<()> {
    // With a function that controls, step by step.
    let mut nstep = nstep;
    while nstep > 0 && control(py, m, d)? {
        steps(py, m, d, 1)?;
        nstep -= 1;
    }
    steps(py, m, d, nstep)
}

#[inline]
fn steps(py: Python, m: &Bound<MjModel>, d: &Bound<MjData>, nstep: usize) -> PyResult<()> {
    let mut data = d.try_borrow_mut()?;
    data.pull(py, &mut m.borrow_mut())?;
    let result = advance(py, &mut data.core, nstep);
    data.push(py);
    if result.is_err() {
        data.warn(py)?;
    }
    result
}

fn advance(py: Python, core: &mut Core, nstep: usize) -> PyResult<()> {
    if nstep * core.model.bodies.len() < WORK {
        return core.step(nstep).map_err(|e| step_error(py, &e));
    }
    let chunk = (CHUNK / core.model.bodies.len()).max(1);
    let mut left = nstep;
    while left > 0 {
        let n = left.min(chunk);
        py.detach(|| core.step(n)).map_err(|e| step_error(py, &e))?;
        left -= n;
        if left > 0 {
            py.check_signals()?;
        }
    }
    Ok(())
}

/// Everything at the state: poses, contacts, forces, accelerations, sensors. Nothing moves.
#[pyfunction]
pub fn mj_forward(py: Python, m: &Bound<MjModel>, d: &Bound<MjData>) -> PyResult<()> {
    control(py, m, d)?;
    let mut data = d.try_borrow_mut()?;
    data.pull(py, &mut m.borrow_mut())?;
    data.core.forward();
    data.fresh(py);
    // Of more contacts than the scene may have none is kept.
    if data.core.data.counts.crowded > 0 { data.warn(py) } else { Ok(()) }
}

/// Inverse dynamics: the forces that accelerations `d.qacc` need at the state, into `d.qfrc_inverse`.
///
///     qfrc_inverse = M qacc + qfrc_bias − qfrc_passive − Jᵀ f,    f each constraint's own formula at qacc
///
/// Forces of contacts, `qfrc_constraint` and sensors are those at `qacc`, too.
#[pyfunction]
pub fn mj_inverse(py: Python, m: &Bound<MjModel>, d: &Bound<MjData>) -> PyResult<()> {
    let mut data = d.try_borrow_mut()?;
    data.pull(py, &mut m.borrow_mut())?;
    let acceleration = data.qacc_written(py);
    data.core.inverse(&acceleration);
    data.fresh(py);
    Ok(())
}

/// The first half of a step, before controls and forces are set: everything at the state.
#[pyfunction]
pub fn mj_step1(py: Python, m: &Bound<MjModel>, d: &Bound<MjData>) -> PyResult<()> {
    if control(py, m, d)? { Ok(()) } else { mj_forward(py, m, d) }
}

/// The second half of a step, with the controls and forces that are set now. As in MuJoCo RK4 becomes Euler here.
#[pyfunction]
pub fn mj_step2(py: Python, m: &Bound<MjModel>, d: &Bound<MjData>) -> PyResult<()> {
    let mut data = d.try_borrow_mut()?;
    data.pull(py, &mut m.borrow_mut())?;
    if data.core.method.integrator.name == integrate::rk4::METHOD.name {
        data.core.method.integrator = &integrate::semi_implicit_euler::METHOD;
    }
    let result = data.core.step(1).map_err(|e| step_error(py, &e));
    data.push(py);
    if result.is_err() {
        data.warn(py)?;
    }
    result
}

/// Poses of everything at qpos and mocap poses, and nothing else, unless the model was changed.
#[pyfunction]
pub fn mj_kinematics(py: Python, m: &Bound<MjModel>, d: &Bound<MjData>) -> PyResult<()> {
    let mut data = d.try_borrow_mut()?;
    data.follow(py, &mut m.borrow_mut())?;
    let Core { model, state, at, data: engine, .. } = &mut data.core;
    at.qpos.copy_from_slice(&state.qpos);
    dynamics::mocap(model, state, engine);
    dynamics::kinematics(model, &state.qpos, engine);
    data.fresh(py);
    Ok(())
}

/// Quantities that Penny computes when they are read: there is nothing left to do.
macro_rules! when_read {
    ($($(#[$doc:meta])* $name:ident;)*) => {$(
        $(#[$doc])*
        #[pyfunction]
        pub fn $name(m: &Bound<MjModel>, d: &Bound<MjData>) -> PyResult<()> {
            let _ = (m.try_borrow()?, d.try_borrow()?);
            Ok(())
        }
    )*};
}

when_read! {
    /// `cacc`, `cfrc_ext` and `cfrc_int` are computed when they are read; this call changes nothing.
    mj_rnePostConstraint;
    /// `subtree_linvel` and `subtree_angmom` are computed when they are read; this call changes nothing.
    mj_subtreeVel;
    /// `subtree_com`, `cinert` and `cdof` are computed when they are read; this call changes nothing.
    mj_comPos;
    /// `energy` is computed when it is read; this call changes nothing.
    mj_energyPos;
    /// `energy` is computed when it is read; this call changes nothing.
    mj_energyVel;
}

/// The model's state at rest: `qpos0`, time 0, no controls or applied forces. All that follows from it is computed.
#[pyfunction]
pub fn mj_resetData(py: Python, m: &Bound<MjModel>, d: &Bound<MjData>) -> PyResult<()> {
    reset(py, m, d, |model| Ok(State::new(model)))
}

/// The state of a keyframe.
///
/// Errors: `IndexError` if there is no such keyframe.
#[pyfunction]
pub fn mj_resetDataKeyframe(py: Python, m: &Bound<MjModel>, d: &Bound<MjData>, key: isize) -> PyResult<()> {
    reset(py, m, d, |model| {
        let key = index("keyframe", key, model.keyframes.len())?;
        Ok(State::at(model, &model.keyframes[key]))
    })
}

fn reset(
    py: Python,
    m: &Bound<MjModel>,
    d: &Bound<MjData>,
    state: impl FnOnce(&Model) -> PyResult<State>,
) -> PyResult<()> {
    let mut data = d.try_borrow_mut()?;
    data.pull(py, &mut m.borrow_mut())?;
    data.core.state = state(&data.core.model)?;
    data.core.forward();
    data.push_all(py);
    data.set_warnings(py, None)
}

/// The kind of thing by `mjtObj`, as the prefix of its arrays.
fn kind_of(objtype: i64) -> PyResult<&'static str> {
    Ok(match objtype {
        1 | 2 => "body",
        3 => "jnt",
        5 => "geom",
        6 => "site",
        7 => "cam",
        17 => "eq",
        18 => "tendon",
        19 => "actuator",
        20 => "sensor",
        24 => "key",
        other => return Err(PyNotImplementedError::new_err(format!("Penny has no names of mjtObj {other}"))),
    })
}

/// The id of a name; −1 if there is none.
#[pyfunction]
pub fn mj_name2id(m: &Bound<MjModel>, r#type: i64, name: &str) -> PyResult<i64> {
    let (m, kind) = (m.try_borrow()?, kind_of(r#type)?);
    let names = m.names(kind).unwrap_or_default();
    Ok(names.iter().position(|n| *n == name && !name.is_empty()).map_or(-1, |i| i as i64))
}

/// The name of an id; `None` if it has none, or there is no such thing.
#[pyfunction]
pub fn mj_id2name(m: &Bound<MjModel>, r#type: i64, id: i64) -> PyResult<Option<String>> {
    let (m, kind) = (m.try_borrow()?, kind_of(r#type)?);
    let names = m.names(kind).unwrap_or_default();
    let name = usize::try_from(id).ok().and_then(|i| names.get(i).copied());
    Ok(name.filter(|n| !n.is_empty()).map(str::to_owned))
}

/// The inertia matrix, (nv, nv), into `dst`.
#[pyfunction]
pub fn mj_fullM(m: &Bound<MjModel>, d: &Bound<MjData>, dst: Real) -> PyResult<()> {
    let (data, nv) = (d.try_borrow()?, m.try_borrow()?.model.nv);
    if dst.shape() != [nv, nv] {
        return Err(PyTypeError::new_err(format!("dst should be of shape ({nv}, {nv}), not {:?}", dst.shape())));
    }
    fill("dst", &dst, &quantities::inertia_matrix(&data.core.model, &data.core.data))
}

/// res = M vec
#[pyfunction]
pub fn mj_mulM(m: &Bound<MjModel>, d: &Bound<MjData>, res: Real, vec: Given) -> PyResult<()> {
    let (data, nv) = (d.try_borrow()?, m.try_borrow()?.model.nv);
    let v = numbers("vec", &vec, nv)?;
    let matrix = quantities::inertia_matrix(&data.core.model, &data.core.data);
    let product: Vec<f64> = matrix.chunks(nv.max(1)).map(|row| row.iter().zip(&v).map(|(a, b)| a * b).sum()).collect();
    fill("res", &res, &product)
}

/// Jacobian of a point of a body: rows of the linear part, rows of the angular part, each (3, nv).
fn jacobian(core: &Core, body: usize, point: &Vec3) -> [Vec<f64>; 2] {
    let nv = core.model.nv;
    let [mut linear, mut angular] = [vec![0.0; 3 * nv], vec![0.0; 3 * nv]];
    dynamics::each_column(&core.model, &core.data, body, point, |d, column| {
        for i in 0..3 {
            linear[i * nv + d] = column[i];
            angular[i * nv + d] = column[3 + i];
        }
    });
    [linear, angular]
}

fn give_jacobian(core: &Core, rows: [(&str, Option<Real>); 2], body: usize, point: &Vec3) -> PyResult<()> {
    let nv = core.model.nv;
    for ((name, to), values) in rows.into_iter().zip(jacobian(core, body, point)) {
        if let Some(to) = to {
            if to.shape() != [3, nv] {
                return Err(PyTypeError::new_err(format!("{name} should be of shape (3, nv), not {:?}", to.shape())));
            }
            fill(name, &to, &values)?;
        }
    }
    Ok(())
}

/// Jacobian of a point of the world that is attached to a body: `jacp` (linear) and `jacr` (angular), each (3, nv) or None.
#[pyfunction]
pub fn mj_jac(
    m: &Bound<MjModel>,
    d: &Bound<MjData>,
    jacp: Option<Real>,
    jacr: Option<Real>,
    point: Given,
    body: isize,
) -> PyResult<()> {
    let data = d.try_borrow()?;
    let body = index("body", body, m.try_borrow()?.model.bodies.len())?;
    let point = vec3(&numbers("point", &point, 3)?);
    give_jacobian(&data.core, [("jacp", jacp), ("jacr", jacr)], body, &point)
}

/// Jacobian of the origin of a body's frame.
#[pyfunction]
pub fn mj_jacBody(
    m: &Bound<MjModel>,
    d: &Bound<MjData>,
    jacp: Option<Real>,
    jacr: Option<Real>,
    body: isize,
) -> PyResult<()> {
    let data = d.try_borrow()?;
    let body = index("body", body, m.try_borrow()?.model.bodies.len())?;
    give_jacobian(&data.core, [("jacp", jacp), ("jacr", jacr)], body, &data.core.data.xpos[body])
}

/// Jacobian of a body's centre of mass.
#[pyfunction]
pub fn mj_jacBodyCom(
    m: &Bound<MjModel>,
    d: &Bound<MjData>,
    jacp: Option<Real>,
    jacr: Option<Real>,
    body: isize,
) -> PyResult<()> {
    let data = d.try_borrow()?;
    let body = index("body", body, m.try_borrow()?.model.bodies.len())?;
    let point = dynamics::xipos(&data.core.model, &data.core.data, body);
    give_jacobian(&data.core, [("jacp", jacp), ("jacr", jacr)], body, &point)
}

/// Jacobian of a geom's centre.
#[pyfunction]
pub fn mj_jacGeom(
    m: &Bound<MjModel>,
    d: &Bound<MjData>,
    jacp: Option<Real>,
    jacr: Option<Real>,
    geom: isize,
) -> PyResult<()> {
    let data = d.try_borrow()?;
    let geom = &data.core.model.geoms[index("geom", geom, m.try_borrow()?.model.geoms.len())?];
    let point = data.core.data.xpos[geom.body] + data.core.data.xmat[geom.body] * geom.pos;
    give_jacobian(&data.core, [("jacp", jacp), ("jacr", jacr)], geom.body, &point)
}

/// Jacobian of a site's centre.
#[pyfunction]
pub fn mj_jacSite(
    m: &Bound<MjModel>,
    d: &Bound<MjData>,
    jacp: Option<Real>,
    jacr: Option<Real>,
    site: isize,
) -> PyResult<()> {
    let data = d.try_borrow()?;
    let site = &data.core.model.sites[index("site", site, m.try_borrow()?.model.sites.len())?];
    let point = data.core.data.xpos[site.body] + data.core.data.xmat[site.body] * site.pos;
    give_jacobian(&data.core, [("jacp", jacp), ("jacr", jacr)], site.body, &point)
}

/// Jacobian of the centre of mass of a body and all that hangs on it: `jacp` (3, nv).
#[pyfunction]
pub fn mj_jacSubtreeCom(m: &Bound<MjModel>, d: &Bound<MjData>, jacp: Real, body: isize) -> PyResult<()> {
    let (data, nv) = (d.try_borrow()?, m.try_borrow()?.model.nv);
    let Core { model, data: engine, .. } = &data.core;
    let top = index("body", body, model.bodies.len())?;
    let mass = quantities::subtree_mass(model)[top];
    let mut sum = vec![0.0; 3 * nv];
    let below = |mut b: usize| {
        while b > top {
            b = model.bodies[b].parent;
        }
        b == top
    };
    for b in (top..model.bodies.len()).filter(|b| below(*b)) {
        let share = model.bodies[b].mass / mass.max(penny::math::MIN_VAL);
        let point = dynamics::xipos(model, engine, b);
        dynamics::each_column(model, engine, b, &point, |d, column| {
            (0..3).for_each(|i| sum[i * nv + d] += share * column[i]);
        });
    }
    fill("jacp", &jacp, &sum)
}

/// Force and torque of a contact in its frame: normal, two tangential (N), torsional, two rolling (N m).
#[pyfunction]
pub fn mj_contactForce(m: &Bound<MjModel>, d: &Bound<MjData>, id: isize, result: Real) -> PyResult<()> {
    let (data, _) = (d.try_borrow()?, m.try_borrow()?);
    let contact = data.contact_at(id)?;
    fill("result", &result, &crate::contact::force(&data.core, contact))
}

/// Adds to `qfrc_target` (nv) what a force (N) and a torque (N m) at a point of a body exert along the dofs.
#[pyfunction]
pub fn mj_applyFT(
    m: &Bound<MjModel>,
    d: &Bound<MjData>,
    force: Given,
    torque: Given,
    point: Given,
    body: isize,
    qfrc_target: Real,
) -> PyResult<()> {
    let (data, m) = (d.try_borrow()?, m.try_borrow()?);
    let body = index("body", body, m.model.bodies.len())?;
    let [force, torque, point] = [("force", &force), ("torque", &torque), ("point", &point)]
        .map(|(name, given)| numbers(name, given, 3).map(|v| vec3(&v)));
    let wrench = spatial::join(&force?, &torque?);
    let mut sum: Vec<f64> = qfrc_target.to_vec()?;
    if sum.len() != m.model.nv {
        return Err(PyTypeError::new_err(format!("qfrc_target should have nv = {} numbers", m.model.nv)));
    }
    dynamics::each_column(&data.core.model, &data.core.data, body, &point?, |d, column| sum[d] += column.dot(&wrench));
    fill("qfrc_target", &qfrc_target, &sum)
}

/// Body, place and orientation of a body, geom or site.
fn frame(core: &Core, objtype: i64, id: isize) -> PyResult<(usize, Vec3, Quat)> {
    let Core { model, data, .. } = core;
    let (body, pos, turn) = match objtype {
        1 => {
            let b = index("body", id, model.bodies.len())?;
            (b, model.bodies[b].ipos, model.bodies[b].iquat)
        }
        2 => (index("body", id, model.bodies.len())?, Vec3::zeros(), Quat::identity()),
        5 => {
            let g = &model.geoms[index("geom", id, model.geoms.len())?];
            (g.body, g.pos, g.quat)
        }
        6 => {
            let s = &model.sites[index("site", id, model.sites.len())?];
            (s.body, s.pos, s.quat)
        }
        other => return Err(PyValueError::new_err(format!("mjtObj {other} has no velocity"))),
    };
    Ok((body, data.xpos[body] + data.xmat[body] * pos, data.xquat[body] * turn))
}

/// Velocity of a body, geom or site at its centre: angular (rad/s), linear (m/s), into `res` (6); in world axes or, with
/// `flg_local`, its own.
#[pyfunction]
pub fn mj_objectVelocity(
    m: &Bound<MjModel>,
    d: &Bound<MjData>,
    objtype: i64,
    objid: isize,
    res: Real,
    flg_local: i64,
) -> PyResult<()> {
    let (data, _) = (d.try_borrow()?, m.try_borrow()?);
    let Core { model, data: engine, .. } = &data.core;
    let (body, point, axes) = frame(&data.core, objtype, objid)?;
    let twist: Vec6 = dynamics::twist(model, engine, body);
    let twist = spatial::at(&twist, &(point - dynamics::xipos(model, engine, body)));
    let (mut v, mut w) = (spatial::lin(&twist), spatial::ang(&twist));
    if flg_local != 0 {
        (v, w) = (axes.inverse() * v, axes.inverse() * w);
    }
    fill("res", &res, &[w.x, w.y, w.z, v.x, v.y, v.z])
}

/// Moves `qpos` (nq) along the velocity `qvel` (nv) for a time `dt`, s.
#[pyfunction]
pub fn mj_integratePos(m: &Bound<MjModel>, qpos: Real, qvel: Given, dt: f64) -> PyResult<()> {
    let m = m.try_borrow()?;
    let (mut q, v) = (qpos.to_vec()?, numbers("qvel", &qvel, m.model.nv)?);
    if q.len() != m.model.nq {
        return Err(PyTypeError::new_err(format!("qpos should have nq = {} numbers, not {}", m.model.nq, q.len())));
    }
    integrate::displace(&m.model, &mut q, &v, dt);
    fill("qpos", &qpos, &q)
}

/// The velocity (nv) that leads from `qpos1` to `qpos2` (nq) in a time `dt`, s, into `qvel`.
#[pyfunction]
pub fn mj_differentiatePos(m: &Bound<MjModel>, qvel: Real, dt: f64, qpos1: Given, qpos2: Given) -> PyResult<()> {
    let m = m.try_borrow()?;
    let (a, b) = (numbers("qpos1", &qpos1, m.model.nq)?, numbers("qpos2", &qpos2, m.model.nq)?);
    let mut v = vec![0.0; m.model.nv];
    for joint in &m.model.joints {
        let (mut q, mut d) = (joint.qposadr, joint.dofadr);
        if joint.kind == JointKind::Free {
            (0..3).for_each(|i| v[d + i] = (b[q + i] - a[q + i]) / dt);
            (q, d) = (q + 3, d + 3);
        }
        match joint.kind {
            JointKind::Slide | JointKind::Hinge => v[d] = (b[q] - a[q]) / dt,
            JointKind::Ball | JointKind::Free => {
                let turned = quat(&a[q..q + 4]).inverse() * quat(&b[q..q + 4]);
                v[d..d + 3].copy_from_slice((turned.scaled_axis() / dt).as_slice());
            }
        }
    }
    fill("qvel", &qvel, &v)
}

/// Makes all quaternions of `qpos` (nq) unit quaternions.
#[pyfunction]
pub fn mj_normalizeQuat(m: &Bound<MjModel>, qpos: Real) -> PyResult<()> {
    let m = m.try_borrow()?;
    let mut q = qpos.to_vec()?;
    if q.len() != m.model.nq {
        return Err(PyTypeError::new_err(format!("qpos should have nq = {} numbers, not {}", m.model.nq, q.len())));
    }
    for joint in m.model.joints.iter().filter(|j| matches!(j.kind, JointKind::Ball | JointKind::Free)) {
        let at = joint.qposadr + joint.kind.nq() - 4;
        let unit = wxyz(&quat(&q[at..at + 4]));
        q[at..at + 4].copy_from_slice(&unit);
    }
    fill("qpos", &qpos, &q)
}

/// Mass of all bodies, kg.
#[pyfunction]
pub fn mj_getTotalmass(py: Python, m: &Bound<MjModel>) -> PyResult<f64> {
    let mut m = m.try_borrow_mut()?;
    m.sync(py)?;
    Ok(m.model.bodies.iter().map(|b| b.mass).sum())
}

/// Takes up what was written into the model now instead of at the next step.
#[pyfunction]
pub fn mj_setConst(py: Python, m: &Bound<MjModel>, d: &Bound<MjData>) -> PyResult<()> {
    let _ = d.try_borrow()?;
    m.try_borrow_mut()?.sync(py)
}

/// `dest` becomes a copy of `src`: the state, and what belongs to it.
#[pyfunction]
pub fn mj_copyData(py: Python, dest: &Bound<MjData>, m: &Bound<MjModel>, src: &Bound<MjData>) -> PyResult<()> {
    if dest.is(src) {
        return Ok(());
    }
    let (mut other, mut to) = (src.try_borrow_mut()?, dest.try_borrow_mut()?);
    other.follow(py, &mut m.borrow_mut())?;
    to.pull(py, &mut m.borrow_mut())?;
    let (from, into) = (&other.core, &mut to.core);
    into.state.copy_from(&from.state);
    into.at.copy_from(&from.at);
    into.data = from.data.clone();
    into.qfrc_inverse.clone_from(&from.qfrc_inverse);
    into.inverted = from.inverted;
    to.push_all(py);
    to.set_warnings(py, Some(&other))
}

/// Distance along a ray (in lengths of `vec`) from a point of the world to the nearest geom; −1 if there is none.
///
/// Geoms are left out whose group `geomgroup` (6) says 0 for, with `flg_static` false those that never move, those of
/// the body `bodyexclude` (−1: none), and what is quite transparent. `geomid` (1) gets the geom's id.
#[pyfunction]
#[pyo3(signature = (m, d, pnt, vec, geomgroup, flg_static, bodyexclude, geomid, normal=None))]
#[allow(clippy::too_many_arguments)]
pub fn mj_ray(
    m: &Bound<MjModel>,
    d: &Bound<MjData>,
    pnt: Given,
    vec: Given,
    geomgroup: Option<Given>,
    flg_static: &Bound<PyAny>,
    bodyexclude: i64,
    geomid: Option<Out<i32>>,
    normal: Option<&Bound<PyAny>>,
) -> PyResult<f64> {
    if normal.is_some() {
        return Err(PyNotImplementedError::new_err("mj_ray: Penny finds no normal where a ray meets a geom"));
    }
    let (data, _) = (d.try_borrow()?, m.try_borrow()?);
    let Core { model, data: engine, .. } = &data.core;
    let (origin, direction) = (vec3(&numbers("pnt", &pnt, 3)?), vec3(&numbers("vec", &vec, 3)?));
    let groups = geomgroup.map(|g| numbers("geomgroup", &g, 6)).transpose()?;
    // MuJoCo's own examples write 1.
    let flg_static = flg_static.is_truthy()?;
    let seen = |g: &penny::model::Geom| {
        let group = g.group.clamp(0, 5) as usize;
        groups.as_ref().is_none_or(|groups| groups[group] != 0.0)
            && (flg_static || model.bodies[g.body].weld != 0)
            && g.body as i64 != bodyexclude
            && g.rgba[3] != 0.0
    };
    let mut nearest: Option<(f64, usize)> = None;
    for (i, geom) in model.geoms.iter().enumerate().filter(|(_, g)| seen(g)) {
        let pos = engine.xpos[geom.body] + engine.xmat[geom.body] * geom.pos;
        let axes = penny::math::mat(&(engine.xquat[geom.body] * geom.quat));
        let met = penny::collision::ray::distance(geom.kind, &geom.size, &pos, &axes, &origin, &direction);
        if let Some(t) = met.filter(|t| nearest.is_none_or(|(least, _)| *t < least)) {
            nearest = Some((t, i));
        }
    }
    if let Some(id) = geomid {
        let mut id = id.try_readwrite().map_err(|e| PyTypeError::new_err(format!("geomid cannot be written: {e}")))?;
        id.as_array_mut().fill(nearest.map_or(-1, |(_, i)| i as i32));
    }
    Ok(nearest.map_or(-1.0, |(t, _)| t))
}
