//! What is Penny's own: problems of a file as Python's objects, and what its contacts mean.

use penny::mjcf::{Document, Problem, Severity};
use penny_lab::plot::palette::{CURVES, MARKERS};
use penny_lab::plot::{self, Axis, Figure, Layer, Line, Panel};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::model::MjModel;

/// `penny.SceneError`
pub fn scene_error_type(py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
    py.import("penny._errors")?.getattr("SceneError")
}

/// `penny.StepError`
pub fn step_error_type(py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
    py.import("penny._errors")?.getattr("StepError")
}

/// A list of `penny.Problem`.
pub fn problems<'py>(py: Python<'py>, document: &Document, problems: &[Problem]) -> PyResult<Bound<'py, PyList>> {
    let class = py.import("penny._errors")?.getattr("Problem")?;
    let one = |problem: &Problem| {
        let file = document.files.get(problem.span.file as usize);
        let (line, column) = file.map_or((0, 0), |f| f.line_column(problem.span.start as usize));
        let given = PyDict::new(py);
        let severity = if problem.severity() == Severity::Error { "error" } else { "warning" };
        given.set_item("severity", severity)?;
        given.set_item("code", problem.kind.code())?;
        given.set_item("message", problem.kind.to_string())?;
        given.set_item("file", file.map_or("", |f| f.name.as_str()))?;
        given.set_item("line", line)?;
        given.set_item("column", column)?;
        given.set_item("help", problem.help.as_deref())?;
        given.set_item("text", penny::mjcf::render(document, std::slice::from_ref(problem), false).trim_end())?;
        class.call((), Some(&given))
    };
    PyList::new(py, problems.iter().map(one).collect::<PyResult<Vec<_>>>()?)
}

/// All problems of a scene's text, each with its place and cure: errors and warnings, in the order of the file.
#[pyfunction]
#[pyo3(signature = (text, name="scene.xml"))]
pub fn check<'py>(py: Python<'py>, text: &str, name: &str) -> PyResult<Bound<'py, PyList>> {
    match py.detach(|| penny::parse(name, text)) {
        Ok(scene) => problems(py, &scene.document, &scene.warnings),
        Err(failure) => problems(py, &failure.document, &failure.problems),
    }
}

/// What the contacts of a scene mean in SI units under the law, integrator and timestep of `m.opt`: a list of
/// dictionaries, one for each pair of geoms that can touch, ready for `pandas.DataFrame`.
///
/// | key | what |
/// |---|---|
/// | `geom1`, `geom2` | names, or numbers where there is none |
/// | `points`, `mass` | contact points; effective mass along the normal, kg |
/// | `stiffness`, `damping` | N/m, N s/m at rest under the weight |
/// | `restitution` | share of its speed that a fast impact gives back |
/// | `rest_depth` | m |
/// | `largest_timestep` | the largest at which the pair is stable, s, measured |
///
/// `None` where the law has no such number.
#[pyfunction]
pub fn explain<'py>(py: Python<'py>, m: &Bound<'py, MjModel>) -> PyResult<Bound<'py, PyList>> {
    let (model, method) = {
        let mut m = m.borrow_mut();
        m.sync(py)?;
        (m.model.clone(), m.method)
    };
    let found = py.detach(|| {
        let touches = penny_lab::explain::touches(&model);
        let of = |touch| {
            let meaning = penny_lab::explain::meaning(&model, &method, &touch, 0.0).formulas;
            let largest = penny_lab::explain::probe::largest_timestep(&model, &method, &touch);
            (touch, meaning, largest)
        };
        touches.into_iter().map(of).collect::<Vec<_>>()
    });
    let rows = PyList::empty(py);
    for (touch, meaning, largest) in found {
        let row = PyDict::new(py);
        for (key, geom) in ["geom1", "geom2"].into_iter().zip(touch.geom) {
            let name = &model.geoms[geom].name;
            let shown = if name.is_empty() { geom.to_string() } else { name.clone() };
            row.set_item(key, shown)?;
        }
        row.set_item("points", touch.points)?;
        row.set_item("mass", touch.mass)?;
        let spring = meaning.springs.map(|[rest, _]| rest);
        row.set_item("stiffness", spring.map(|s| s.k))?;
        row.set_item("damping", spring.map(|s| s.c))?;
        row.set_item("restitution", meaning.restitution)?;
        row.set_item("rest_depth", meaning.rest_depth)?;
        row.set_item("largest_timestep", largest)?;
        rows.append(row)?;
    }
    Ok(rows)
}

/// Curves of a name and points, and a panel's quantity.
type Curves = (String, Vec<(String, Vec<[f64; 2]>)>);

/// A chart as SVG: panels beside each other, each a quantity over x, with their curves by name.
#[pyfunction]
pub fn _chart(title: String, x: String, log: bool, panels: Vec<Curves>) -> PyResult<String> {
    let axis = || if log { Axis::log(x.clone()) } else { Axis::linear(x.clone()) };
    let panel = |(quantity, curves): Curves| {
        let line = |(i, (name, points))| {
            let (color, marker) = (CURVES[i % CURVES.len()], MARKERS[i % MARKERS.len()]);
            Layer::Line(Line::new(name, color, points).marked(marker))
        };
        Panel::new("", axis(), Axis::linear(quantity), curves.into_iter().enumerate().map(line).collect())
    };
    let figure = Figure::new(title, "", panels.into_iter().map(panel).collect());
    plot::svg(&figure).map_err(|why| PyValueError::new_err(why.to_string()))
}
