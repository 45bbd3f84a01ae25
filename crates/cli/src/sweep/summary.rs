//! `penny sweep … --summary`: for many scenes, what an accuracy costs.

use std::fs;
use std::path::{Path, PathBuf};

use indicatif::ProgressBar;

use super::super::files::{self as paths, cannot_write};
use super::super::format::{file_name, short, si, table};
use super::super::scene;
use super::{Args, Failure, TOLERANCES, bar, cannot};
use penny::contact::{self, Law};
use penny_lab::accuracy::Stepping;
use penny_lab::accuracy::survey::{Price, prices};
use penny_lab::explain::Budget;
use penny_lab::plot::palette::{CURVES, DASHES, GREY, MARKERS};
use penny_lab::plot::{self, Axis, Figure, Layer, Line, Panel};
use penny_lab::sweep::Case;

/// Evaluations of a run.
const MOST: usize = 200_000;
/// Real time of a search, s.
const SEARCH: f64 = 10.0;
const CSV: &str = "summary.csv";
const PICTURES: [&str; 2] = ["summary.svg", "summary.png"];

/// A scene under a law.
struct Entry {
    scene: String,
    law: &'static Law,
    prices: Vec<Price>,
}

pub fn summary(args: &Args) -> Result<(), Failure> {
    let directory = args.out.clone().unwrap_or_else(|| PathBuf::from("sweep-summary"));
    let written: Vec<PathBuf> = [CSV].into_iter().chain(PICTURES).map(|file| directory.join(file)).collect();
    let written: Vec<(&str, Option<&Path>)> = written.iter().map(|path| ("--out", Some(path.as_path()))).collect();
    let mut cases = Vec::new();
    for path in &args.scenes {
        let model = scene::load_apart(path, &args.limits, &written)?;
        let start = args.start.state(&model)?;
        let own = model.contact_law().and_then(contact::by_name).unwrap_or(contact::default());
        let laws = if args.laws.is_empty() { vec![own] } else { args.laws(&model) };
        cases.push((file_name(path), laws, Case { model, start, seconds: args.time }));
    }
    fs::create_dir_all(&directory).map_err(cannot(&directory))?;
    let work: usize = cases.iter().map(|(_, laws, _)| laws.len()).sum();
    let progress: ProgressBar = bar("scenes", work as u64);
    let mut entries = Vec::new();
    for (scene, laws, case) in &cases {
        for &law in laws {
            let prices = prices(case, law, &TOLERANCES, MOST, &|| Budget::seconds(SEARCH));
            entries.push(Entry { scene: scene.clone(), law, prices });
            progress.inc(1);
        }
    }
    progress.finish_and_clear();
    let file = directory.join(CSV);
    paths::write(&file, &csv(&entries).map_err(|e| cannot_write(&file, &e))?)?;
    let figure = figure(&entries, args.time);
    for file in PICTURES {
        plot::save(&figure, &directory.join(file)).map_err(|e| Failure::Problem(format!("error: {e}")))?;
    }
    println!(
        "{} of each scene; evaluations of the accelerations: fixed steps | --accuracy (with its search)",
        si(args.time, "s")
    );
    print!("{}", table(&lines(&entries)));
    println!("{}: {CSV}, {}, {}", directory.display(), PICTURES[0], PICTURES[1]);
    Ok(())
}

/// "implicitfast 5 ms, 200 | cash-karp ± 1 µm, 344 (784)"
fn told(price: &Price) -> String {
    let count = |n: usize| short(n as f64);
    let fixed = price.fixed.map_or_else(
        || "none cheaper".to_owned(),
        |f| format!("{} {}, {}", f.integrator, si(f.timestep, "s"), count(f.evaluations)),
    );
    let chosen = match &price.chosen {
        None => return "no truth".to_owned(),
        Some(Err(_)) => "refused".to_owned(),
        Some(Ok((choice, _))) => {
            let how = match choice.stepping {
                Stepping::Fixed(timestep) => si(timestep, "s"),
                Stepping::Controlled(tolerance) => format!("± {}", si(tolerance, "m")),
            };
            let by = choice.method.integrator.name;
            format!("{by} {how}, {} ({})", count(choice.evaluations), count(choice.trial))
        }
    };
    format!("{fixed} | {chosen}")
}

fn lines(entries: &[Entry]) -> Vec<Vec<String>> {
    let mut lines = vec![vec!["scene".to_owned(), "law".to_owned()]];
    lines[0].extend(TOLERANCES.map(|wanted| format!("{wanted:.0e} m")));
    for entry in entries {
        let mut line = vec![entry.scene.clone(), entry.law.name.to_owned()];
        line.extend(entry.prices.iter().map(told));
        lines.push(line);
    }
    lines
}

fn csv(entries: &[Entry]) -> std::io::Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let head = "scene law wanted_m seconds fixed_integrator fixed_timestep_s fixed_evaluations chosen_integrator controlled \
                chosen_evaluations search_evaluations error_m";
    writer.write_record(head.split_whitespace())?;
    for entry in entries {
        for price in &entry.prices {
            let mut row =
                vec![entry.scene.clone(), entry.law.name.into(), price.wanted.to_string(), price.seconds.to_string()];
            row.extend(price.fixed.map_or([const { String::new() }; 3], |f| {
                [f.integrator.to_owned(), f.timestep.to_string(), f.evaluations.to_string()]
            }));
            row.extend(match &price.chosen {
                Some(Ok((choice, error))) => [
                    choice.method.integrator.name.to_owned(),
                    matches!(choice.stepping, Stepping::Controlled(_)).to_string(),
                    choice.evaluations.to_string(),
                    choice.trial.to_string(),
                    error.to_string(),
                ],
                Some(Err(_)) => ["refused".to_owned(), String::new(), String::new(), String::new(), String::new()],
                None => [const { String::new() }; 5],
            });
            writer.write_record(row)?;
        }
    }
    let bytes = writer.into_inner().map_err(|e| std::io::Error::other(e.to_string()))?;
    String::from_utf8(bytes).map_err(std::io::Error::other)
}

/// What `--accuracy` takes over what the cheapest fixed steps take: one marker a scene, one colour an accuracy.
fn figure(entries: &[Entry], seconds: f64) -> Figure {
    let mut layers = Vec::new();
    let mut ends = [f64::INFINITY, 0.0f64];
    for (k, wanted) in TOLERANCES.iter().enumerate() {
        let place = |e: &Entry| {
            let price = &e.prices[k];
            let (choice, _) = price.chosen.as_ref()?.as_ref().ok()?;
            // Where no fixed steps are cheaper than the search, they cost more than that.
            let fixed = price.fixed.map_or(choice.trial, |f| f.evaluations);
            Some([fixed, choice.evaluations].map(|n| n as f64 / price.seconds))
        };
        let mut points: Vec<[f64; 2]> = entries.iter().filter_map(place).collect();
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        for x in points.iter().flatten() {
            ends = [ends[0].min(*x), ends[1].max(*x)];
        }
        layers.push(Layer::Line(Line::new(format!("{wanted:.0e} m"), CURVES[k], points).marked(MARKERS[k]).wide(0.0)));
    }
    let diagonal = vec![[ends[0]; 2], [ends[1]; 2]];
    layers.insert(0, Layer::Line(Line::new("as cheap", GREY, diagonal).dashed(DASHES[1]).wide(1.0)));
    let panel = Panel::new(
        "",
        Axis::log("fixed steps [evaluations per simulated second]"),
        Axis::log("--accuracy [evaluations per simulated second]"),
        layers,
    );
    let subtitle = format!(
        "{} of each of {} scenes; below the dashed line --accuracy has found something cheaper than all fixed steps",
        si(seconds, "s"),
        entries.len()
    );
    Figure { panel_size: [640.0, 420.0], ..Figure::new("What an accuracy costs", subtitle, vec![panel]) }
}
