//! `MjOption`: how a model is computed, MuJoCo's names and Penny's contact law.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

use penny::forward::Method;
use penny::math::vec3;
use penny::model::{Cone, Flags, Model};
use penny::{contact, integrate, mjcf};
use pyo3::exceptions::{PyNotImplementedError, PyTypeError, PyValueError};
use pyo3::prelude::*;

use crate::array::Array;
use crate::model::{assign, lacking};

/// Options of a model; what is set takes effect at the next step.
///
/// `law` is Penny's: 'mujoco' (the default in this module), 'penalty', 'tutorial'. `integrator` takes MuJoCo's numbers
/// (`mjtIntegrator`) and Penny's names: 'explicit-euler', 'semi-implicit-euler', 'implicit-euler', 'rk4', 'implicitfast',
/// 'cash-karp', 'extrapolated-euler'.
#[pyclass(name = "MjOption", module = "penny")]
pub struct MjOption {
    pub method: Method,
    /// The keyword of the scene's integrator, while it is that one.
    keyword: Option<String>,
    numbers: Numbers,
    pub watch: Arc<Watch>,
}

/// What a model looks at before every step, without borrowing its options.
pub struct Watch {
    gravity: Array<f64>,
    wind: Array<f64>,
    magnetic: Array<f64>,
    /// Anything but these vectors was set.
    dirty: AtomicBool,
}

/// Gravity, wind, magnetic.
pub type Vectors = [f64; 9];

impl Watch {
    fn new(py: Python, vectors: &Vectors, dirty: bool) -> PyResult<Arc<Watch>> {
        let array = |i: usize| Array::new(py, vectors[3 * i..3 * i + 3].to_vec(), &[3]);
        let dirty = AtomicBool::new(dirty);
        Ok(Arc::new(Watch { gravity: array(0)?, wind: array(1)?, magnetic: array(2)?, dirty }))
    }

    /// Whether anything differs from what a model has.
    pub fn changed(&self, py: Python, has: &Vectors) -> bool {
        let same = |i: usize, array: &Array<f64>| array.same(py, &has[3 * i..3 * i + 3]);
        let Watch { gravity, wind, magnetic, dirty } = self;
        dirty.load(Relaxed) || !(same(0, gravity) && same(1, wind) && same(2, magnetic))
    }

    pub fn now(&self, py: Python) -> Vectors {
        let mut now = [0.0; 9];
        for (i, array) in [&self.gravity, &self.wind, &self.magnetic].into_iter().enumerate() {
            array.read(py, &mut now[3 * i..3 * i + 3]);
        }
        now
    }
}

/// Those of a model.
pub fn vectors(model: &Model) -> Vectors {
    let opt = &model.opt;
    let mut vectors = [0.0; 9];
    for (to, from) in vectors.iter_mut().zip(opt.gravity.iter().chain(&opt.wind).chain(&opt.magnetic)) {
        *to = *from;
    }
    vectors
}

#[derive(Clone)]
struct Numbers {
    density: f64,
    viscosity: f64,
    impratio: f64,
    tolerance: f64,
    iterations: usize,
    noslip_iterations: usize,
    noslip_tolerance: f64,
    cone: Cone,
    flags: Flags,
}

/// mjtDisableBit, where Penny has the flag.
type Bit = (u32, fn(&mut Flags) -> &mut bool);
const BITS: &[Bit] = &[
    (0, |f| &mut f.constraint),
    (1, |f| &mut f.equality),
    (2, |f| &mut f.frictionloss),
    (3, |f| &mut f.limit),
    (4, |f| &mut f.contact),
    (5, |f| &mut f.spring),
    (6, |f| &mut f.damper),
    (7, |f| &mut f.gravity),
    (8, |f| &mut f.clampctrl),
    (9, |f| &mut f.warmstart),
    (11, |f| &mut f.actuation),
    (12, |f| &mut f.refsafe),
    (13, |f| &mut f.sensor),
    (18, |f| &mut f.island),
    (15, |f| &mut f.eulerdamp),
];
/// Which geoms can touch is decided when a scene is compiled.
const FILTERPARENT: u32 = 10;
/// mjENBL_DIAGEXACT
const DIAGEXACT: u32 = 5;

const KEYWORDS: [&str; 5] = ["Euler", "RK4", "implicit", "implicitfast", "discrete"];
const NAMES: &[&str] = &[
    "timestep", "gravity", "wind", "magnetic", "density", "viscosity", "impratio", "tolerance", "iterations",
    "noslip_iterations", "noslip_tolerance", "integrator", "cone", "disableflags", "enableflags", "law", "solver",
];

impl MjOption {
    pub fn of(py: Python, model: &Model, method: Method) -> PyResult<MjOption> {
        let opt = &model.opt;
        Ok(MjOption {
            method,
            keyword: Some(opt.integrator.clone()),
            numbers: Numbers {
                density: opt.density,
                viscosity: opt.viscosity,
                impratio: opt.impratio,
                tolerance: opt.tolerance,
                iterations: opt.iterations,
                noslip_iterations: opt.noslip_iterations,
                noslip_tolerance: opt.noslip_tolerance,
                cone: opt.cone,
                flags: opt.flags.clone(),
            },
            watch: Watch::new(py, &vectors(model), false)?,
        })
    }

    pub fn copy(&self, py: Python) -> PyResult<MjOption> {
        let dirty = self.watch.dirty.load(Relaxed);
        Ok(MjOption {
            method: self.method,
            keyword: self.keyword.clone(),
            numbers: self.numbers.clone(),
            watch: Watch::new(py, &self.watch.now(py), dirty)?,
        })
    }

    /// Gives the model what was set: the vectors `now`, and all else.
    ///
    /// Errors: `ValueError` for what it cannot be; the vectors then have the old numbers again.
    pub fn apply(&self, py: Python, now: &Vectors, model: &mut Arc<Model>, method: &mut Method) -> PyResult<()> {
        let (before, numbers) = (vectors(model), self.numbers.clone());
        let timestep = self.method.timestep;
        let result = Arc::make_mut(model).edit(|parts| {
            let opt = &mut parts.opt;
            (opt.gravity, opt.wind, opt.magnetic) = (vec3(now), vec3(&now[3..]), vec3(&now[6..]));
            (opt.density, opt.viscosity, opt.impratio) = (numbers.density, numbers.viscosity, numbers.impratio);
            (opt.tolerance, opt.iterations, opt.cone) = (numbers.tolerance, numbers.iterations, numbers.cone);
            (opt.noslip_iterations, opt.noslip_tolerance) = (numbers.noslip_iterations, numbers.noslip_tolerance);
            (opt.flags, opt.timestep) = (numbers.flags, timestep);
        });
        if let Err(why) = result {
            let Watch { gravity, wind, magnetic, .. } = &*self.watch;
            for (i, array) in [gravity, wind, magnetic].into_iter().enumerate() {
                array.write(py, &before[3 * i..3 * i + 3]);
            }
            return Err(PyValueError::new_err(format!("opt: {why}")));
        }
        *method = self.method;
        self.watch.dirty.store(false, Relaxed);
        Ok(())
    }

    /// mjtDisableBit: what is switched off.
    fn disabled(&self) -> u32 {
        let mut flags = self.numbers.flags.clone();
        let filter = u32::from(!flags.filterparent) << FILTERPARENT;
        BITS.iter().filter(|(_, flag)| !*flag(&mut flags)).fold(filter, |all, (bit, _)| all | 1 << bit)
    }

    fn disable(&mut self, bits: u32) -> PyResult<()> {
        let known = BITS.iter().fold(1 << FILTERPARENT, |all, (bit, _)| all | 1u32 << bit);
        // Automatic resets and details of MuJoCo's collision code.
        const WITHOUT_EFFECT: u32 = 1 << 14 | 1 << 16 | 1 << 17 | 1 << 18 | 1 << 19;
        if bits & !(known | WITHOUT_EFFECT) != 0 {
            return Err(PyNotImplementedError::new_err(format!(
                "disableflags {bits:#x}: Penny has no such flag to switch off"
            )));
        }
        if (bits >> FILTERPARENT & 1 == 1) == self.numbers.flags.filterparent {
            return Err(PyValueError::new_err(
                "filterparent: which geoms can touch is decided when a scene is compiled",
            ));
        }
        BITS.iter().for_each(|(bit, flag)| *flag(&mut self.numbers.flags) = bits >> bit & 1 == 0);
        Ok(())
    }

    fn above_zero(name: &str, value: &Bound<PyAny>) -> PyResult<f64> {
        let x: f64 = value.extract()?;
        if x > 0.0 && x.is_finite() {
            Ok(x)
        } else {
            Err(PyValueError::new_err(format!("{name} is above zero, not {x}")))
        }
    }

    fn not_negative(name: &str, value: &Bound<PyAny>) -> PyResult<f64> {
        let x: f64 = value.extract()?;
        if x >= 0.0 && x.is_finite() {
            Ok(x)
        } else {
            Err(PyValueError::new_err(format!("{name} is zero or above, not {x}")))
        }
    }

    fn set_integrator(&mut self, value: &Bound<PyAny>) -> PyResult<()> {
        if let Ok(name) = value.extract::<String>() {
            let Some(found) = integrate::by_name(&name).filter(|i| i.name == name) else {
                let known: Vec<_> = integrate::ALL.iter().map(|i| i.name).collect();
                return Err(PyValueError::new_err(format!("no integrator '{name}': {}", known.join(", "))));
            };
            (self.method.integrator, self.keyword) = (found, None);
            return Ok(());
        }
        let number: usize = value.extract()?;
        let Some(&keyword) = KEYWORDS.get(number) else {
            return Err(PyValueError::new_err(format!("no integrator {number}")));
        };
        // `implicit` is another method than `implicitfast` but for free bodies, which the compiler knows.
        let same = self.keyword.as_deref() == Some(keyword);
        match integrate::by_name(keyword) {
            Some(found) if same || !matches!(keyword, "implicit" | "discrete") => {
                (self.method.integrator, self.keyword) = (found, Some(keyword.to_owned()));
                Ok(())
            }
            _ => Err(PyNotImplementedError::new_err(format!("Penny has no integrator `{keyword}` for this scene"))),
        }
    }
}

#[pymethods]
impl MjOption {
    #[new]
    fn py_new(py: Python) -> PyResult<MjOption> {
        let scene = penny::parse("scene.xml", "<mujoco/>").map_err(|f| PyValueError::new_err(f.to_string()))?;
        let mut method = Method::of(&scene.model);
        method.contact = contact::by_name("mujoco").unwrap_or(contact::default());
        MjOption::of(py, &scene.model, method)
    }

    #[getter]
    fn timestep(&self) -> f64 {
        self.method.timestep
    }

    fn __getattr__(&self, py: Python, name: &str) -> PyResult<Py<PyAny>> {
        let real = |x: f64| Ok(x.into_pyobject(py)?.into_any().unbind());
        let whole = |x: u64| Ok(x.into_pyobject(py)?.into_any().unbind());
        let n = &self.numbers;
        match name {
            "gravity" => Ok(self.watch.gravity.object(py).into_any().unbind()),
            "wind" => Ok(self.watch.wind.object(py).into_any().unbind()),
            "magnetic" => Ok(self.watch.magnetic.object(py).into_any().unbind()),
            "density" => real(n.density),
            "viscosity" => real(n.viscosity),
            "impratio" => real(n.impratio),
            "tolerance" => real(n.tolerance),
            "iterations" => whole(n.iterations as u64),
            "noslip_iterations" => whole(n.noslip_iterations as u64),
            "noslip_tolerance" => real(n.noslip_tolerance),
            "cone" => whole(u64::from(n.cone == Cone::Elliptic)),
            "disableflags" => whole(u64::from(self.disabled())),
            "enableflags" => whole(u64::from(n.flags.diagexact) << DIAGEXACT),
            "law" => Ok(self.method.contact.name.into_pyobject(py)?.into_any().unbind()),
            // Newton's method, whatever is set in the file.
            "solver" => whole(2),
            "integrator" => {
                let own = self.keyword.as_deref();
                let keyword = own.or(self.method.integrator.mjcf.first().copied());
                match keyword.and_then(|k| KEYWORDS.iter().position(|known| *known == k)) {
                    Some(number) => whole(number as u64),
                    None => Ok(self.method.integrator.name.into_pyobject(py)?.into_any().unbind()),
                }
            }
            _ => Err(lacking("MjOption", name, NAMES.iter().copied())),
        }
    }

    fn __setattr__(&mut self, py: Python, name: &str, value: &Bound<PyAny>) -> PyResult<()> {
        self.watch.dirty.store(true, Relaxed);
        match name {
            "gravity" => return assign(&self.watch.gravity.object(py), value),
            "wind" => return assign(&self.watch.wind.object(py), value),
            "magnetic" => return assign(&self.watch.magnetic.object(py), value),
            "timestep" => self.method.timestep = MjOption::above_zero(name, value)?,
            "density" => self.numbers.density = MjOption::not_negative(name, value)?,
            "viscosity" => self.numbers.viscosity = MjOption::not_negative(name, value)?,
            "impratio" => self.numbers.impratio = MjOption::above_zero(name, value)?,
            "tolerance" => self.numbers.tolerance = MjOption::not_negative(name, value)?,
            "iterations" => self.numbers.iterations = value.extract()?,
            "noslip_iterations" => self.numbers.noslip_iterations = value.extract()?,
            "noslip_tolerance" => self.numbers.noslip_tolerance = MjOption::not_negative(name, value)?,
            "cone" => {
                self.numbers.cone = match value.extract::<i64>()? {
                    0 => Cone::Pyramidal,
                    1 => Cone::Elliptic,
                    other => return Err(PyValueError::new_err(format!("no cone {other}"))),
                }
            }
            "disableflags" => self.disable(value.extract()?)?,
            "enableflags" => {
                let bits: u32 = value.extract()?;
                // Energies are always there when they are asked for.
                const ENERGY: u32 = 1 << 1;
                if bits & !(1 << DIAGEXACT | ENERGY) != 0 {
                    return Err(PyNotImplementedError::new_err(format!(
                        "enableflags {bits:#x}: Penny has no such flag"
                    )));
                }
                self.numbers.flags.diagexact = bits >> DIAGEXACT & 1 == 1;
            }
            "law" => {
                let law: String = value.extract()?;
                let names = || contact::ALL.iter().map(|l| l.name);
                self.method.contact = contact::by_name(&law).ok_or_else(|| {
                    let hint = mjcf::nearest(&law, names()).map(|n| format!("did you mean '{n}'?"));
                    let all = names().collect::<Vec<_>>().join(", ");
                    PyValueError::new_err(format!("no contact law '{law}': {}", hint.unwrap_or(all)))
                })?;
            }
            "integrator" => self.set_integrator(value)?,
            "solver" if value.extract::<i64>().is_ok_and(|s| s == 2) => {}
            "solver" => {
                return Err(PyNotImplementedError::new_err("solver: Penny has Newton's method only (mjSOL_NEWTON)"));
            }
            _ => return Err(lacking("MjOption", name, NAMES.iter().copied())),
        }
        Ok(())
    }

    fn __delattr__(&self, name: &str) -> PyResult<()> {
        Err(PyTypeError::new_err(format!("`{name}` of MjOption cannot be deleted")))
    }

    fn __dir__(&self) -> Vec<&'static str> {
        NAMES.to_vec()
    }
}
