//! `penny sweep --map X,Y`: where a scene stays stable, and where theory says it does.

use std::collections::BTreeMap;
use std::path::Path;

use indicatif::{ProgressBar, ProgressStyle};
use serde_json::json;

use super::Failure;
use super::files::cannot_write;
use super::format::{file_name, short, si, table};
use super::scene;
use penny::contact::Law;
use penny::draft;
use penny::forward::Method;
use penny::integrate::Integrator;
use penny_lab::plot::palette::{CLASSES, INK, Marker, PAPER};
use penny_lab::plot::{self, Axis, Cells, Figure, Layer, Line, Panel};
use penny_lab::sweep::Case;
use penny_lab::sweep::map::{self as stability, Class, Limit, Map, QUANTITIES, Quantity, Range, Setting};

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

/// What a map is of, besides its axes.
pub struct Request<'a> {
    pub path: &'a Path,
    pub case: Case,
    pub laws: Vec<&'static Law>,
    pub integrators: Vec<&'static Integrator>,
    pub rounds: usize,
    pub cells: usize,
    pub directory: &'a Path,
}

pub fn map(request: &Request, Axes(axes): &Axes) -> Result<(), Failure> {
    let Request { path, case, rounds, cells, .. } = request;
    let timestep = case.model.opt.timestep;
    let setting = |contact, integrator| Setting {
        case: case.clone(),
        method: Method { contact, integrator, timestep, rounds: *rounds },
    };
    let methods: Vec<_> = request.laws.iter().flat_map(|&l| request.integrators.iter().map(move |&i| (l, i))).collect();
    let first = methods.first().ok_or_else(|| Failure::Usage("error: no method to map".to_owned()))?;
    let quantities = [axes[0].quantity, axes[1].quantity];
    let mut spans = [[0.0; 2]; 2];
    for (span, axis) in spans.iter_mut().zip(axes) {
        *span = range(axis, &setting(first.0, first.1))?;
    }
    let [x, y] = spans.map(|[low, high]| edges(low, high, *cells));
    let mut sheet = Sheet::new(request, quantities)?;
    if stability::touches_nothing(&setting(first.0, first.1)) {
        sheet.note = format!("Nothing touches within {}: this is the flight alone. ", si(case.seconds, "s"));
        eprintln!(
            "warning: nothing touches within {}, so the map shows the flight alone: give it more time with --time",
            si(case.seconds, "s")
        );
    }
    let bar = ProgressBar::new((cells * cells * methods.len()) as u64);
    if let Ok(style) = ProgressStyle::with_template("  map {wide_bar} {percent} %, {eta} to go") {
        bar.set_style(style);
    }
    for (contact, integrator) in methods {
        let setting = setting(contact, integrator);
        let found = stability::map(&setting, quantities, &centres(&x), &centres(&y), || bar.inc(1));
        let limits = limits(&setting, quantities, &found);
        let name = if request.laws.len() == 1 {
            integrator.name.to_owned()
        } else {
            format!("{}, {}", contact.name, integrator.name)
        };
        sheet.predicted |= limits.list.iter().any(|l| l.theory.is_some());
        sheet.rows.push(summary(&name, quantities, &limits));
        sheet.records.push(record([contact.name, integrator.name], quantities, &found, &limits));
        sheet.panels.push(panel(&name, quantities, [&x, &y], &found, &limits));
        sheet.save([&found.x, &found.y])?;
    }
    bar.finish_and_clear();
    print!("{}: limits by theory and as measured\n{}", path.display(), table(&sheet.rows));
    println!("{}: {stem}.json, {stem}.svg, {stem}.png", request.directory.display(), stem = sheet.stem);
    Ok(())
}

/// What a map leaves. Written anew after each method, so that an interruption leaves those that are done.
struct Sheet<'a> {
    request: &'a Request<'a>,
    quantities: [&'static Quantity; 2],
    stem: String,
    /// What is special about the runs; or empty.
    note: String,
    /// Whether theory has a limit anywhere.
    predicted: bool,
    rows: Vec<Vec<String>>,
    records: Vec<serde_json::Value>,
    panels: Vec<Panel>,
}

impl<'a> Sheet<'a> {
    fn new(request: &'a Request<'a>, quantities: [&'static Quantity; 2]) -> Result<Sheet<'a>, Failure> {
        std::fs::create_dir_all(request.directory).map_err(|e| cannot_write(request.directory, &e))?;
        let stem = format!("map-{}-{}", quantities[0].name, quantities[1].name);
        let rows = vec![heading()];
        Ok(Sheet {
            request,
            quantities,
            stem,
            note: String::new(),
            predicted: false,
            rows,
            records: Vec::new(),
            panels: Vec::new(),
        })
    }

    fn save(&self, [x, y]: [&[f64]; 2]) -> Result<(), Failure> {
        let Request { path, laws, integrators, directory, case, .. } = self.request;
        let laws: Vec<_> = laws.iter().map(|law| law.name).collect();
        let time = format!("{}, or {} steps where that is longer", si(case.seconds, "s"), stability::FEWEST);
        let mut figure = Figure::new(
            format!("Where {} stays stable", file_name(path)),
            format!(
                "{}{} law; each run takes {time}.\n{}; dots: limit as measured.\n\
                 Rattling: {}.\nEnergy-gaining: {}.\nDiverging: {}.",
                self.note,
                laws.join(", "),
                match self.predicted {
                    true => "White line: limit by theory, the spectral radius of the integrator's map of the spring",
                    false => "By theory no limit lies here",
                },
                Class::Rattling.criterion(),
                Class::Gaining.criterion(),
                Class::Diverging.criterion()
            ),
            self.panels.clone(),
        );
        figure.columns = integrators.len().min(if laws.len() == 1 { 3 } else { 5 });
        let alone = laws.len() * integrators.len() == 1;
        figure.panel_size = if alone { [520.0, 400.0] } else { [270.0, 240.0] };
        figure.legend = Class::ALL.iter().map(|c| (CLASSES[*c as usize], c.name().to_owned())).collect();
        for ending in ["svg", "png"] {
            let file = directory.join(format!("{}.{ending}", self.stem));
            plot::save(&figure, &file).map_err(|e| Failure::Problem(format!("error: {e}")))?;
        }
        let document = json!({
            "scene": path.file_name().map(|n| n.to_string_lossy()), "laws": laws, "time": case.seconds,
            "x": self.quantities[0].name, "y": self.quantities[1].name, "x_values": x, "y_values": y,
            "criteria": Class::ALL.iter().map(|c| (c.name(), c.criterion())).collect::<BTreeMap<_, _>>(),
            "finished": self.records.len() == laws.len() * integrators.len(),
            "methods": self.records,
        });
        let file = directory.join(format!("{}.json", self.stem));
        draft::write(&file, format!("{document:#}\n")).map_err(|e| cannot_write(&file, &e))?;
        Ok(())
    }
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

/// Log-spaced edges of this many cells.
fn edges(low: f64, high: f64, cells: usize) -> Vec<f64> {
    (0..=cells).map(|i| low * (high / low).powf(i as f64 / cells as f64)).collect()
}

fn centres(edges: &[f64]) -> Vec<f64> {
    edges.windows(2).map(|pair| (pair[0] * pair[1]).sqrt()).collect()
}

/// Limits, and the axis that they are of.
struct Limits {
    along: usize,
    list: Vec<Limit>,
}

/// Limits of the timestep if it is an axis. Else of the axis along which theory has more of them.
fn limits(setting: &Setting, quantities: [&Quantity; 2], found: &Map) -> Limits {
    let on = |along: usize| Limits { along, list: stability::limits(setting, quantities, found, along) };
    if let Some(along) = quantities.iter().position(|q| q.name == "timestep") {
        return on(along);
    }
    let predicted = |limits: &Limits| limits.list.iter().filter(|l| l.theory.is_some()).count();
    let [x, y] = [0, 1].map(on);
    if predicted(&x) > predicted(&y) { x } else { y }
}

fn heading() -> Vec<String> {
    ["", "limit of", "at", "theory", "measured", "median deviation", "largest"].map(str::to_owned).to_vec()
}

/// The limit in the middle of the map, and how far measurement is from theory anywhere.
fn summary(name: &str, quantities: [&Quantity; 2], Limits { along, list }: &Limits) -> Vec<String> {
    let number = |x: Option<f64>| x.map_or("none".to_owned(), short);
    let both = |l: &Limit| Some((l.measured? / l.theory? - 1.0).abs());
    let mut deviations: Vec<f64> = list.iter().filter_map(both).collect();
    deviations.sort_by(f64::total_cmp);
    let percent = |x: Option<&f64>| x.map_or("–".to_owned(), |w| format!("{:.2} %", 100.0 * w));
    let found = |l: &&Limit| l.theory.is_some() || l.measured.is_some();
    let limit = list.iter().filter(found).nth(list.iter().filter(found).count() / 2);
    let [of, other] = [quantities[*along].name, quantities[1 - along].name];
    vec![
        name.to_owned(),
        of.to_owned(),
        limit.map_or(format!("any {other}"), |l| format!("{other} {}", short(l.at))),
        number(limit.and_then(|l| l.theory)),
        number(limit.and_then(|l| l.measured)),
        percent(deviations.get(deviations.len() / 2)),
        percent(deviations.last()),
    ]
}

fn record([law, integrator]: [&str; 2], quantities: [&Quantity; 2], found: &Map, limits: &Limits) -> serde_json::Value {
    let list: Vec<_> =
        limits.list.iter().map(|l| json!({ "at": l.at, "theory": l.theory, "measured": l.measured })).collect();
    json!({
        "law": law,
        "integrator": integrator,
        "classes": found.classes.iter().map(|c| c.name()).collect::<Vec<_>>(),
        "limits_of": quantities[limits.along].name,
        "limits": list,
    })
}

fn panel(name: &str, quantities: [&Quantity; 2], edges: [&[f64]; 2], found: &Map, limits: &Limits) -> Panel {
    let colors = found.classes.iter().map(|c| CLASSES[*c as usize]).collect();
    let mut layers = vec![Layer::Cells(Cells { x: edges[0].to_vec(), y: edges[1].to_vec(), colors })];
    let place = |at: f64, limit: f64| if limits.along == 0 { [limit, at] } else { [at, limit] };
    let theory: Vec<[f64; 2]> = limits.list.iter().filter_map(|l| Some(place(l.at, l.theory?))).collect();
    let measured: Vec<[f64; 2]> = limits.list.iter().filter_map(|l| Some(place(l.at, l.measured?))).collect();
    layers.push(Layer::Line(Line::new("", INK, theory.clone()).over().wide(5.0)));
    layers.push(Layer::Line(Line::new("", PAPER, theory).over().wide(2.5)));
    layers.push(Layer::Line(Line::new("", INK, measured).over().wide(0.0).marked(Marker::Circle)));
    let axis = |q: &Quantity| Axis::log(q.label).tight();
    Panel::new(name, axis(quantities[0]), axis(quantities[1]), layers)
}
