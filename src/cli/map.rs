//! `penny sweep --map X,Y`: where a scene stays stable, and where theory says it does.

use std::path::Path;

use indicatif::{ProgressBar, ProgressStyle};
use serde_json::json;

use super::Failure;
use super::format::{short, table};
use super::scene;
use crate::contact::Law;
use crate::forward::Method;
use crate::integrate::Integrator;
use crate::plot::palette::{CLASSES, INK, Marker, PAPER};
use crate::plot::{self, Axis, Cells, Figure, Layer, Line, Panel};
use crate::sweep::Case;
use crate::sweep::map::{self as stability, Class, Map, QUANTITIES, Quantity, Range, Setting};

/// The two axes of a map, each with its range if one was given.
#[derive(Clone)]
pub struct Axes([AxisArg; 2]);

#[derive(Clone)]
struct AxisArg {
    quantity: &'static Quantity,
    range: Option<[f64; 2]>,
}

// clap wants to print defaults and conflicts; the function pointers inside a quantity have nothing to say.
impl std::fmt::Debug for Axes {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{},{}", self.0[0].quantity.name, self.0[1].quantity.name)
    }
}

pub fn axes(text: &str) -> Result<Axes, String> {
    let Some((x, y)) = text.split_once(',') else {
        return Err("must be two quantities with a comma between them: timestep,stiffness".to_owned());
    };
    let axes = Axes([axis(x)?, axis(y)?]);
    if axes.0[0].quantity.name == axes.0[1].quantity.name {
        return Err("must be two different quantities".to_owned());
    }
    Ok(axes)
}

fn axis(text: &str) -> Result<AxisArg, String> {
    let (name, range) = match text.split_once('=') {
        Some((name, range)) => (name, Some(range)),
        None => (text, None),
    };
    let known = || QUANTITIES.iter().map(|q| q.name).collect::<Vec<_>>().join(", ");
    let quantity = stability::quantity(name).ok_or_else(|| format!("`{name}` is none of {}", known()))?;
    let range = match range.map(|r| r.split_once("..").ok_or("a range is LOW..HIGH")) {
        None => None,
        Some(ends) => {
            let (low, high) = ends?;
            let positive = |s: &str| scene::positive(s).map_err(|_| format!("`{s}` is not a number above 0"));
            Some([positive(low)?, positive(high)?])
                .filter(|[l, h]| l < h)
                .map_or(Err("a range is LOW..HIGH"), |r| Ok(Some(r)))?
        }
    };
    Ok(AxisArg { quantity, range })
}

/// Columns or rows at which the measured limit is looked for.
const PROBES: usize = 12;

/// The limit at one value of the other quantity: by theory and as measured.
struct Limit {
    at: f64,
    theory: Option<f64>,
    measured: Option<f64>,
}

pub fn map(
    path: &Path,
    case: Case,
    laws: &[&'static Law],
    integrators: &[&'static Integrator],
    Axes(axes): &Axes,
    cells: usize,
    directory: &Path,
) -> Result<(), Failure> {
    let timestep = case.model.opt.timestep;
    let own = case.model.contact_law().and_then(|name| laws.iter().find(|l| l.name == name));
    let contact = own.or(laws.first()).copied().ok_or_else(|| Failure::Usage("error: no contact law".to_owned()))?;
    let setting =
        |integrator| Setting { case: case.clone(), method: Method { contact, integrator, timestep, rounds: 1 } };
    let quantities = [axes[0].quantity, axes[1].quantity];
    let mut spans = [[0.0; 2]; 2];
    for (span, axis) in spans.iter_mut().zip(axes) {
        *span = range(axis, &setting(integrators[0]))?;
    }
    let [x, y] = spans.map(|[low, high]| edges(low, high, cells));
    let bar = ProgressBar::new((cells * cells * integrators.len()) as u64);
    if let Ok(style) = ProgressStyle::with_template("  map {wide_bar} {percent} %, {eta} to go") {
        bar.set_style(style);
    }
    let (mut panels, mut rows, mut records) = (Vec::new(), vec![heading(quantities)], Vec::new());
    for &integrator in integrators {
        let setting = setting(integrator);
        let found = stability::map(&setting, quantities, &centres(&x), &centres(&y), || bar.inc(1));
        let limits = limits(&setting, quantities, spans);
        rows.push(summary(integrator, &limits));
        records.push(record(integrator, &found, &limits));
        panels.push(panel(integrator, quantities, [&x, &y], &found, &limits));
    }
    bar.finish_and_clear();

    let mut figure = Figure::new(
        format!("Where {} stays stable", path.display()),
        format!(
            "{} law. White line: limit by theory, the spectral radius of the integrator's map of the spring; dots: limit \
             as measured.\nRattling: {}.\nEnergy-gaining: {}.\nDiverging: {}.",
            contact.name,
            Class::Rattling.criterion(),
            Class::Gaining.criterion(),
            Class::Diverging.criterion()
        ),
        panels,
    );
    figure.columns = integrators.len().min(3);
    figure.panel_size = if integrators.len() == 1 { [520.0, 400.0] } else { [270.0, 240.0] };
    figure.legend = Class::ALL.iter().map(|c| (CLASSES[*c as usize], c.name().to_owned())).collect();
    std::fs::create_dir_all(directory)
        .map_err(|e| Failure::Problem(format!("error: {} cannot be written: {e}", directory.display())))?;
    let stem = format!("map-{}-{}", quantities[0].name, quantities[1].name);
    for ending in ["svg", "png"] {
        let file = directory.join(format!("{stem}.{ending}"));
        plot::save(&figure, &file).map_err(|e| Failure::Problem(format!("error: {e}")))?;
    }
    let document = json!({
        "scene": path.file_name().map(|n| n.to_string_lossy()), "law": contact.name,
        "x": quantities[0].name, "y": quantities[1].name, "x_values": centres(&x), "y_values": centres(&y),
        "criteria": Class::ALL.iter().map(|c| (c.name(), c.criterion())).collect::<std::collections::BTreeMap<_, _>>(),
        "integrators": records,
    });
    std::fs::write(directory.join(format!("{stem}.json")), format!("{document:#}\n"))?;
    eprint!("{}: largest timestep, theory against measurement\n{}", path.display(), table(&rows));
    eprintln!("{}: {stem}.json, {stem}.svg, {stem}.png", directory.display());
    Ok(())
}

/// The range of an axis: as asked for, or the quantity's own.
fn range(axis: &AxisArg, setting: &Setting) -> Result<[f64; 2], Failure> {
    let own = (axis.quantity.get)(setting)
        .map_err(|why| Failure::Problem(format!("error: no map over {}: {why}", axis.quantity.name)))?;
    Ok(axis.range.unwrap_or(match axis.quantity.range {
        Range::Absolute(low, high) => [low, high],
        Range::Around(low, high) => [own * low, own * high],
    }))
}

/// Log-spaced edges of so many cells.
fn edges(low: f64, high: f64, cells: usize) -> Vec<f64> {
    (0..=cells).map(|i| low * (high / low).powf(i as f64 / cells as f64)).collect()
}

fn centres(edges: &[f64]) -> Vec<f64> {
    edges.windows(2).map(|pair| (pair[0] * pair[1]).sqrt()).collect()
}

/// Limits of the timestep along the other axis; none if no axis is the timestep.
fn limits(setting: &Setting, quantities: [&Quantity; 2], spans: [[f64; 2]; 2]) -> Vec<Limit> {
    let Some(time) = quantities.iter().position(|q| q.name == "timestep") else { return Vec::new() };
    let other = 1 - time;
    let values = centres(&edges(spans[other][0], spans[other][1], PROBES));
    let limit = |&at: &f64| {
        let set = |h: f64| {
            let mut pair = [h; 2];
            pair[other] = at;
            stability::at(setting, quantities, pair)
        };
        let grows = |h: f64| stability::predicted(&set(h)).is_some_and(|r| r > 1.0 + 1e-12);
        let theory = stability::boundary(spans[time], |h| !grows(h));
        let measured = stability::boundary(spans[time], |h| !stability::unstable(stability::classify(&set(h))));
        Limit { at, theory, measured }
    };
    values.iter().map(limit).collect()
}

fn heading([x, y]: [&Quantity; 2]) -> Vec<String> {
    let other = if x.name == "timestep" { y } else { x };
    let first = String::new();
    vec![
        first,
        format!("at {}", other.name),
        "theory s".into(),
        "measured s".into(),
        "median deviation".into(),
        "largest".into(),
    ]
}

/// The limit in the middle of the map, and how far measurement is from theory anywhere.
fn summary(integrator: &Integrator, limits: &[Limit]) -> Vec<String> {
    let number = |x: Option<f64>| x.map_or("none".to_owned(), short);
    let both = |l: &Limit| Some((l.measured? / l.theory? - 1.0).abs());
    let mut deviations: Vec<f64> = limits.iter().filter_map(both).collect();
    deviations.sort_by(f64::total_cmp);
    let percent = |x: Option<&f64>| x.map_or("–".to_owned(), |w| format!("{:.2} %", 100.0 * w));
    let found = |l: &&Limit| l.theory.is_some() || l.measured.is_some();
    let limit = limits.iter().filter(found).nth(limits.iter().filter(found).count() / 2);
    vec![
        integrator.name.to_owned(),
        number(limit.map(|l| l.at)),
        number(limit.and_then(|l| l.theory)),
        number(limit.and_then(|l| l.measured)),
        percent(deviations.get(deviations.len() / 2)),
        percent(deviations.last()),
    ]
}

fn record(integrator: &Integrator, found: &Map, limits: &[Limit]) -> serde_json::Value {
    let limits: Vec<_> =
        limits.iter().map(|l| json!({ "at": l.at, "theory": l.theory, "measured": l.measured })).collect();
    json!({
        "integrator": integrator.name,
        "classes": found.classes.iter().map(|c| c.name()).collect::<Vec<_>>(),
        "limits": limits,
    })
}

fn panel(
    integrator: &Integrator,
    quantities: [&Quantity; 2],
    edges: [&[f64]; 2],
    found: &Map,
    limits: &[Limit],
) -> Panel {
    let colors = found.classes.iter().map(|c| CLASSES[*c as usize]).collect();
    let mut layers = vec![Layer::Cells(Cells { x: edges[0].to_vec(), y: edges[1].to_vec(), colors })];
    let place = |at: f64, h: f64| if quantities[0].name == "timestep" { [h, at] } else { [at, h] };
    let theory: Vec<[f64; 2]> = limits.iter().filter_map(|l| Some(place(l.at, l.theory?))).collect();
    let measured: Vec<[f64; 2]> = limits.iter().filter_map(|l| Some(place(l.at, l.measured?))).collect();
    layers.push(Layer::Line(Line::new("", INK, theory.clone()).over().wide(5.0)));
    layers.push(Layer::Line(Line::new("", PAPER, theory).over().wide(2.5)));
    layers.push(Layer::Line(Line::new("", INK, measured).over().wide(0.0).marked(Marker::Circle)));
    let axis = |q: &Quantity| Axis::log(q.label).tight();
    Panel::new(integrator.name, axis(quantities[0]), axis(quantities[1]), layers)
}
