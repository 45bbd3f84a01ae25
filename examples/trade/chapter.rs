//! The chapter's experiments. Every number in its text and every curve in its figures comes from here; cost is
//! counted in evaluations of the forces, which are the same on every machine.

use penny::contact::{self, Law};
use penny::data::Data;
use penny::dynamics::energy;
use penny::forward::{Method, step};
use penny::integrate::{self, Integrator};
use penny::model::Model;
use penny::state::State;
use penny_lab::accuracy::survey;
use penny_lab::explain::Budget;
use penny_lab::plot::palette::{CLASSES, CURVES, DASHES, GREY, INK, MARKERS, Marker, PAPER};
use penny_lab::plot::{Axis, Cells, Figure, Layer, Line, Panel, number};
use penny_lab::sweep::map::{self, Class, Setting};
use penny_lab::sweep::reference::converged;
use penny_lab::sweep::trajectory::{self, distance};
use penny_lab::sweep::validation::Record;
use penny_lab::sweep::{Case, formulas, grid, theory};

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

pub struct Chapter {
    pub text: String,
    /// File name in docs/trade and figure.
    pub figures: Vec<(&'static str, Figure)>,
}

pub fn write() -> Result<Chapter> {
    let mut chapter = Chapter { text: INTRODUCTION.to_owned(), figures: Vec::new() };
    for section in [points, frictions, integrators, precision, prices, stability, laws] {
        section(&mut chapter)?;
    }
    Ok(chapter)
}

const INTRODUCTION: &str = "# The trade

What does a simulator buy with its time, and what does it get wrong however much it spends? This chapter answers the
course's open questions by experiment. `cargo run --release --example trade` writes every number and figure below;
a test compares them with what the program says today. Cost is counted in evaluations of the forces, not in
seconds, so that the numbers are the same on every machine; `penny sweep SCENE` measures seconds on yours.
";

/// A scene under a method, stepped.
struct Run {
    model: Model,
    method: Method,
    state: State,
    data: Data,
    /// Evaluations of the forces so far.
    evaluations: usize,
}

impl Run {
    fn new(xml: &str, contact: &'static Law, integrator: &'static Integrator, timestep: f64) -> Result<Run> {
        let model = penny::parse("trade.xml", xml).map_err(|e| e.to_string())?.model;
        let (state, data) = (State::new(&model), Data::new(&model));
        Ok(Run {
            method: Method { contact, integrator, timestep, rounds: penny::forward::ROUNDS },
            model,
            state,
            data,
            evaluations: 0,
        })
    }

    /// Steps for a time and looks after every step.
    fn watch(&mut self, seconds: f64, mut look: impl FnMut(&Run)) -> Result<()> {
        look(self);
        for _ in 0..(seconds / self.method.timestep).round() as usize {
            step(&self.model, &self.method, &mut self.state, &mut self.data).map_err(|d| d.to_string())?;
            self.evaluations += self.data.counts.forwards;
            look(self);
        }
        Ok(())
    }

    fn energy(&self) -> f64 {
        let e = energy::energy(&self.model, &self.state, &mut Data::new(&self.model));
        e.kinetic + e.potential
    }
}

fn law(name: &str) -> Result<&'static Law> {
    Ok(contact::by_name(name).ok_or_else(|| format!("no law {name}"))?)
}

fn integrator(name: &str) -> Result<&'static Integrator> {
    Ok(integrate::by_name(name).ok_or_else(|| format!("no integrator {name}"))?)
}

/// A line of a Markdown table.
fn row(cells: &[String]) -> String {
    format!("| {} |\n", cells.join(" | "))
}

fn heading(cells: &[&str]) -> String {
    let rule: Vec<&str> = cells.iter().map(|_| "---").collect();
    format!("| {} |\n| {} |\n", cells.join(" | "), rule.join(" | "))
}

/// The course's circle (m = 1 kg, R = 0.2 m, I = ½ m R²) with geoms for its rim.
fn circle(geoms: &str, mu: f64, mu_roll: f64, k: f64) -> String {
    format!(
        r#"<mujoco><option timestep="0.001"/>
        <custom><numeric name="penny.k" data="{k}"/><numeric name="penny.c" data="20"/><numeric name="penny.mu" data="{mu}"/>
        <numeric name="penny.alpha" data="50"/><numeric name="penny.mu_roll" data="{mu_roll}"/></custom>
        <default><geom condim="6"/></default>
        <worldbody><geom type="plane" size="5 5 .1"/><body pos="0 0 0.2">
        <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/><joint type="hinge" axis="0 -1 0"/>
        <inertial pos="0 0 0" mass="1" diaginertia=".01 .02 .01"/>{geoms}</body></worldbody></mujoco>"#
    )
}

const ROUND: &str = r#"<geom type="sphere" size="0.2"/>"#;

/// One contact point under the centre, or many along the rim?
fn points(chapter: &mut Chapter) -> Result<()> {
    let (v0, stiffness) = (2.0, 2500.0);
    let mut curves = Vec::new();
    let mut table = heading(&[
        "contact points",
        "speed after 3 s [m/s]",
        "energy lost",
        "vertical speed in the last second, rms [mm/s]",
    ]);
    for (i, n) in [12, 24, 48, 96, 0].into_iter().enumerate() {
        let rim = |j: usize| {
            let angle = std::f64::consts::TAU * j as f64 / n as f64;
            format!(r#"<geom type="sphere" size="0.001" pos="{} 0 {}"/>"#, 0.199 * angle.sin(), -0.199 * angle.cos())
        };
        let geoms = if n == 0 { ROUND.to_owned() } else { (0..n).map(rim).collect() };
        let mut run = Run::new(&circle(&geoms, 0.5, 0.0, stiffness), law("tutorial")?, integrator("Euler")?, 1e-3)?;
        // Rolling, at the depth of rest.
        run.state.qpos[1] = -9.81 / stiffness;
        run.state.qvel.copy_from_slice(&[v0, 0.0, -v0 / 0.2]);
        let (before, mut bump, mut speeds) = (run.energy(), 0.0, Vec::new());
        run.watch(3.0, |r| {
            bump += if r.state.time > 2.0 { 1e-3 * r.state.qvel[1].powi(2) } else { 0.0 };
            speeds.push([r.state.time, r.state.qvel[0]]);
        })?;
        let name = if n == 0 { "one, under the centre".to_owned() } else { format!("{n} on the rim") };
        let lost = 100.0 * (before - run.energy()) / (0.75 * v0 * v0);
        let speed = run.state.qvel[0];
        table += &row(&[
            name.clone(),
            format!("{speed:.3}"),
            format!("{lost:.1} %"),
            format!("{:.1}", 1e3 * f64::sqrt(bump)),
        ]);
        curves.push(Layer::Line(Line::new(name, CURVES[i], every(speeds, 10)).dashed(DASHES[i % 4])));
    }
    let panel = Panel::new("", Axis::linear("time [s]").tight(), Axis::linear("speed [m/s]"), curves);
    let subtitle =
        "The course's circle and law, rolling at 2 m/s without rolling friction; semi-implicit Euler, h = 1 ms.";
    chapter.figures.push(("points.svg", Figure::new("A circle of corners is a polygon", subtitle, vec![panel])));
    chapter.text += &format!(
        "
## One contact point or several?

The course's fourth program puts one contact point under the centre, at r = [0, −R], and asks: multiple points? A
circle that rolls at {v0} m/s on one point keeps its speed. A rim of corners does not: it tips from corner to corner,
and each landing costs energy. More corners make it smoother, but not free: in ground that gives, several touch at
once, and those that go in are damped while those that come out are not, for the course's law damps on approach only.

{table}
![speed over time](trade/points.svg)

So: one point, the lowest one, as long as the shape is round. Several where the body is flat: a box needs its
corners, a cylinder on its side both ends of its line.
"
    );
    Ok(())
}

/// Every n-th point, and the last.
fn every(points: Vec<[f64; 2]>, n: usize) -> Vec<[f64; 2]> {
    let last = points.len().saturating_sub(1);
    points.into_iter().enumerate().filter(|(i, _)| i % n == 0 || *i == last).map(|(_, p)| p).collect()
}

/// Rolling friction alone, sliding friction alone, or both?
fn frictions(chapter: &mut Chapter) -> Result<()> {
    let (v0, mu, delta) = (2.0, 0.5, 0.01);
    let mut panels = Vec::new();
    let mut table = heading(&["friction", "speed at 1 s [m/s]", "slip at 1 s [m/s]", "by formula [m/s]"]);
    let slide = formulas::SlideToRoll { v0, k: 0.5, braking: mu * 9.81 };
    // While it slips, rolling resistance turns it too: α = (μ R + δ) m g/I, and a = −μ g.
    let slip_end = v0 / (9.81 * (mu + 0.2 * (mu * 0.2 - delta) / 0.02));
    let rolled = v0 - mu * 9.81 * slip_end - delta * 9.81 / (0.2 * 1.5) * (1.0 - slip_end);
    for (name, mu, delta, exact) in
        [("rolling only", 0.0, delta, v0), ("sliding only", mu, 0.0, slide.end_speed()), ("both", mu, delta, rolled)]
    {
        let mut run = Run::new(&circle(ROUND, mu, delta, 2500.0), law("tutorial")?, integrator("Euler")?, 1e-3)?;
        run.state.qpos[1] = -9.81 / 2500.0;
        run.state.qvel[0] = v0;
        let (mut speed, mut rim) = (Vec::new(), Vec::new());
        run.watch(1.0, |r| {
            speed.push([r.state.time, r.state.qvel[0]]);
            rim.push([r.state.time, -0.2 * r.state.qvel[2]]);
        })?;
        let (v, w) = (run.state.qvel[0], -0.2 * run.state.qvel[2]);
        table += &row(&[name.to_owned(), format!("{v:.3}"), format!("{:.3}", v - w), format!("{exact:.3}")]);
        let curves = vec![
            Layer::Line(Line::new("speed v", CURVES[0], every(speed, 5))),
            Layer::Line(Line::new("rim ωR", CURVES[1], every(rim, 5)).dashed(DASHES[1])),
        ];
        let y = Axis::linear("speed [m/s]").range(-0.1, 2.1);
        panels.push(Panel::new(name, Axis::linear("time [s]").tight(), y, curves));
    }
    let subtitle =
        "A circle starts at 2 m/s without spin: μ = 0.5, rolling coefficient 1 cm. It rolls where both curves meet.";
    let mut figure = Figure::new("It takes both frictions to roll and to stop", subtitle, panels);
    figure.panel_size = [220.0, 220.0];
    chapter.figures.push(("frictions.svg", figure));
    chapter.text += &format!(
        "
## Rolling friction alone, or both?

The course considers only rolling friction, and asks: both? Start the circle at {v0} m/s without spin.

{table}
![speed and rim speed](trade/frictions.svg)

Rolling friction alone is a torque against a spin that nothing drives: sign(ω) flips in every step, and the circle
slides on as on ice. Sliding friction alone makes it roll at v₀/(1 + k), and then it rolls forever. Both together
slide, roll and slow down, as a ball does. (The course's torque has no bound that stops it at ω = 0, so it chatters
by μ_roll F_n h/I there; the `penalty` law bounds it.)
"
    );
    Ok(())
}

/// A mass of 1 kg on a spring with a period of 1 s.
fn spring(damping: f64) -> String {
    let k = std::f64::consts::TAU * std::f64::consts::TAU;
    format!(
        r#"<mujoco><option gravity="0 0 0"/><worldbody><body><joint name="x" type="slide" axis="1 0 0" stiffness="{k}"
        damping="{damping}"/><geom type="sphere" size=".1" mass="1" contype="0" conaffinity="0"/></body></worldbody></mujoco>"#
    )
}

/// Integrators that the course names.
const NAMED: [&str; 4] = ["explicit-euler", "semi-implicit-euler", "implicit-euler", "rk4"];

/// Those and what MuJoCo recommends: the chapter stays the same when an integrator is added to the list.
const COMPARED: [&str; 5] = ["explicit-euler", "semi-implicit-euler", "implicit-euler", "rk4", "implicitfast"];

/// The four integrators at the same cost.
fn integrators(chapter: &mut Chapter) -> Result<()> {
    let budget = 200.0;
    let mut curves = Vec::new();
    let mut table = heading(&[
        "integrator",
        "evaluations a step",
        "timestep [ms]",
        "energy after 10 periods, start = 1",
        "largest stable h ω, theory",
        "measured",
    ]);
    for (i, name) in NAMED.into_iter().enumerate() {
        let integrator = integrator(name)?;
        let mut probe = Run::new(&spring(0.0), contact::ALL[0], integrator, 1e-2)?;
        probe.state.qpos[0] = 1.0;
        probe.watch(0.1, |_| {})?;
        let each = probe.evaluations as f64 / 10.0;
        let timestep = each / budget;
        let mut run = Run::new(&spring(0.0), contact::ALL[0], integrator, timestep)?;
        run.state.qpos[0] = 1.0;
        let start = run.energy();
        let mut course = Vec::new();
        run.watch(10.0, |r| course.push([r.state.time, r.energy() / start]))?;
        let (limit, measured) = limits(integrator)?;
        let limit_text = |x: f64| match x {
            0.0 => "none".to_owned(),
            x if x.is_infinite() => "any".to_owned(),
            x => format!("{x:.3}"),
        };
        let after = run.energy() / start;
        let after = if (after - 1.0).abs() < 0.005 {
            format!("1 {} {}", if after < 1.0 { "−" } else { "+" }, number((after - 1.0).abs()))
        } else {
            number(after)
        };
        let ms = format!("{:.1}", 1e3 * timestep);
        table += &row(&[name.into(), format!("{each}"), ms, after, limit_text(limit), limit_text(measured)]);
        let n = (course.len() / 800).max(1);
        curves.push(Layer::Line(Line::new(name, CURVES[i], every(course, n)).dashed(DASHES[i])));
    }
    let y = Axis::linear("energy, start = 1").range(0.0, 2.5);
    let panel = Panel::new("", Axis::linear("time [periods]").tight(), y, curves);
    let subtitle =
        format!("A mass on a spring without damping, {budget} evaluations of the force a period for each integrator.");
    chapter.figures.push(("energy.svg", Figure::new("What integrators do to energy", subtitle, vec![panel])));
    chapter.text += &format!(
        "
## What integrators do to energy, at the same cost

A mass on a spring, {budget} evaluations of the force a period for each integrator: RK4 takes four a step, so its
steps are four times as long; implicit Euler evaluates once for each column of its Jacobian and for each iteration.

{table}
![energy over time](trade/energy.svg)

Explicit Euler gains energy at every timestep, implicit Euler loses it, semi-implicit Euler lets it swing by ± h ω/2
around its value and never drift, and RK4 loses so little that no plot shows it. The last two columns are the spectral
radius of each integrator's map, and the timestep at which a run's energy starts to grow.
"
    );
    Ok(())
}

/// Largest stable h ω of the undamped spring: by theory, and by bisection with runs.
fn limits(integrator: &'static Integrator) -> Result<(f64, f64)> {
    let model = penny::parse("spring.xml", &spring(0.0)).map_err(|e| e.to_string())?.model;
    let spring = theory::joint_springs(&model).swap_remove(0);
    let theory = theory::limit(integrator, &spring).ok_or("unknown to the theory")? * spring.omega;
    let mut start = State::new(&model);
    start.qpos[0] = 1.0;
    let case = Case { model, start, seconds: 10.0 };
    let grows = |timestep: f64| {
        let method = Method { contact: contact::ALL[0], integrator, timestep, rounds: penny::forward::ROUNDS };
        map::unstable(map::classify(&Setting { case: case.clone(), method }))
    };
    let range = [1e-2 / spring.omega, 10.0 / spring.omega];
    let measured = match map::boundary(range, |h| !grows(h)) {
        Some(h) => h * spring.omega,
        None if grows(range[0]) => 0.0,
        None => f64::INFINITY,
    };
    Ok((theory, measured))
}

/// Error over evaluations, on a scene without contacts and on one with.
fn precision(chapter: &mut Chapter) -> Result<()> {
    let mut panels = Vec::new();
    let mut table = heading(&["integrator", "order, theory", "slope on the pendulum", "slope on the disk"]);
    let compared = COMPARED.into_iter().map(integrator).collect::<Result<Vec<_>>>()?;
    let mut slopes = vec![Vec::new(); compared.len()];
    for (title, xml, steps) in [
        ("pendulum.xml: smooth", include_str!("../../models/pendulum.xml"), [1e-3, 5e-2]),
        ("disk.xml: a landing", include_str!("../../models/disk.xml"), [1e-4, 1e-2]),
    ] {
        let model = penny::parse("trade.xml", xml).map_err(|e| e.to_string())?.model;
        let start = State::new(&model);
        let case = Case { model, start, seconds: 1.0 };
        let law = law("penalty")?;
        let truth = converged(&case, &[law], 2e-5, |_| ()).swap_remove(0).ok_or("no reference")?;
        let mut curves = Vec::new();
        for (i, &integrator) in compared.iter().enumerate() {
            let mut points = Vec::new();
            for timestep in grid::timesteps(&case, steps[0], steps[1], 8) {
                let method = Method { contact: law, integrator, timestep, rounds: penny::forward::ROUNDS };
                let run = trajectory::run(&case, &method);
                let Some(error) = distance(&case.model, &run.samples, &truth.samples) else { continue };
                points.push([evaluations(&case, &method)?, error.max(1e-16)]);
            }
            slopes[i].push(slope(&points));
            let line = Line::new(integrator.name, CURVES[i], points).dashed(DASHES[i % 4]).marked(MARKERS[i]);
            curves.push(Layer::Line(line));
        }
        let x = Axis::log("evaluations of the forces per simulated second");
        panels.push(Panel::new(title, x, Axis::log("error of position [m]"), curves));
    }
    for (integrator, slopes) in compared.iter().zip(&slopes) {
        let mut cells = vec![integrator.name.to_owned(), integrator.order.to_string()];
        cells.extend(slopes.iter().map(|s| format!("{s:.1}")));
        table += &row(&cells);
    }
    let subtitle = "Penalty law, 1 s. Truth: the same law at h = 5 µs.";
    let figure = Figure { panel_size: [300.0, 280.0], ..Figure::new("What accuracy costs", subtitle, panels) };
    chapter.figures.push(("precision.svg", figure));
    chapter.text += &format!(
        "
## What accuracy costs

Where motion is smooth, an integrator's order is worth its price: RK4 reaches any accuracy below a millimetre with far
fewer evaluations than the others. A landing is not smooth: whatever the order, the moment of touch falls somewhere
inside a step, and all fall back to about first order. There the cheapest step wins.

{table}
![error over evaluations](trade/precision.svg)

`penny sweep models/disk.xml` draws the same with all contact laws and in seconds, and names the cheapest method for
each accuracy.
"
    );
    Ok(())
}

/// Evaluations of a run for the truth.
const MOST: usize = 20_000;

fn prices(chapter: &mut Chapter) -> Result<()> {
    let mut table = heading(&["scene", "wanted [m]", "cheapest fixed steps", "`--accuracy` takes", "error [m]"]);
    for (name, xml, seconds) in [
        ("pendulum: smooth", include_str!("../../models/pendulum.xml"), 1.0),
        ("arm: servos", include_str!("../../models/arm.xml"), 1.0),
        ("balls: bounces", include_str!("../../models/balls.xml"), 0.8),
        ("disk_traction: it settles", include_str!("../../models/disk_traction.xml"), 0.8),
        ("stack: a landing, then rest", include_str!("../../models/stack.xml"), 0.5),
    ] {
        let model = penny::parse("trade.xml", xml).map_err(|e| e.to_string())?.model;
        let case = Case { start: State::new(&model), model, seconds };
        {
            let law = law("penalty")?;
            for price in survey::prices(&case, law, &[1e-2, 1e-4, 1e-6], MOST, &Budget::unlimited) {
                let fixed = price.fixed.map_or_else(
                    || "none cheaper".to_owned(),
                    |f| format!("{}, {} ms: {}", f.integrator, number(1e3 * f.timestep), f.evaluations),
                );
                let Some(chosen) = price.chosen else { continue };
                let (chosen, error) = match chosen {
                    Err(_) => ("refused".to_owned(), "–".to_owned()),
                    Ok((choice, error)) => {
                        let how = if choice.effort.is_some() { "controlled" } else { "fixed" };
                        let by = choice.method.integrator.name;
                        (format!("{by}, {how}: {} ({})", choice.evaluations, choice.trial), number(error))
                    }
                };
                let cells = [name.to_owned(), number(price.wanted), fixed, chosen, error];
                table += &row(&cells);
            }
        }
    }
    chapter.text += &format!(
        "
## When is which law, integrator and step the right one

Law `penalty`; evaluations of the whole run, and in brackets of the search that found it. Fixed steps are the cheapest of all
integrators with 64, 128, 256 … steps, which one would have to know beforehand; \"none cheaper\": than the search.

{table}
{RULES}
`penny sweep models/*.xml --summary` makes this table of any scenes, with a picture.
"
    );
    Ok(())
}

const RULES: &str = "\
- A centimetre: `implicitfast` with steps of 4 to 16 ms, wherever nothing bounces. The search takes 1.4 to four times a
  run of some dozen steps, which is microseconds.
- Smooth motion, a millimetre or less: order pays. Fixed steps of `rk4` or `cash-karp` of 8 to 16 ms and controlled steps of
  `cash-karp` take about as many evaluations.
- A tenth of a millimetre where something lands once: still fixed steps. Where it bounces again and again, and at a micrometre
  wherever things touch: controlled steps of `cash-karp`. Fixed steps of any order miss the moment of touch, and at a
  micrometre none was found that costs less than search and run together.
- What another law would change (`penny compare`, and the floors that `penny sweep` draws) is the least error that is worth
  paying for.
";

/// Evaluations of the forces per simulated second, counted.
fn evaluations(case: &Case, method: &Method) -> Result<f64> {
    let (mut state, mut data, mut count) = (case.start.clone(), Data::new(&case.model), 0);
    for _ in 0..(case.seconds / method.timestep).round() as usize {
        step(&case.model, method, &mut state, &mut data).map_err(|d| d.to_string())?;
        count += data.counts.forwards;
    }
    Ok(count as f64 / case.seconds)
}

/// Order that errors show: least-squares slope of log error over log evaluations, above rounding.
fn slope(points: &[[f64; 2]]) -> f64 {
    let logs: Vec<[f64; 2]> = points.iter().filter(|p| p[1] > 1e-12 && p[1] < 0.1).map(|p| p.map(f64::ln)).collect();
    let n = logs.len() as f64;
    let mean = |axis: usize| logs.iter().map(|p| p[axis]).sum::<f64>() / n;
    let (mx, my) = (mean(0), mean(1));
    let (xy, xx) = logs.iter().fold((0.0, 0.0), |(a, b), p| (a + (p[0] - mx) * (p[1] - my), b + (p[0] - mx).powi(2)));
    -xy / xx
}

/// Timesteps of the maps, s.
const STEPS: [f64; 2] = [5e-4, 0.1];

/// Maps of stability of a ball on a stiff contact.
fn stability(chapter: &mut Chapter) -> Result<()> {
    let ball = r#"<mujoco><default><geom solref="-1e4 -40" solimp=".95 .95 .001" condim="1"/></default><worldbody>
        <geom name="ground" type="plane" size="1 1 1"/><body pos="0 0 0.11"><joint type="slide" axis="0 0 1"/>
        <geom name="ball" type="sphere" size=".1" mass="1"/></body></worldbody></mujoco>"#;
    let model = penny::parse("ball.xml", ball).map_err(|e| e.to_string())?.model;
    let start = State::new(&model);
    let case = Case { model, start, seconds: 1.0 };
    let axes = ["timestep", "stiffness"].map(|name| map::quantity(name).ok_or("no such quantity"));
    let axes = [axes[0]?, axes[1]?];
    let edges = |low: f64, high: f64, n: usize| -> Vec<f64> {
        (0..=n).map(|i| low * (high / low).powf(i as f64 / n as f64)).collect()
    };
    let centres = |edges: &[f64]| -> Vec<f64> { edges.windows(2).map(|p| (p[0] * p[1]).sqrt()).collect() };
    let (x, y) = (edges(STEPS[0], STEPS[1], 24), edges(1e2, 1e6, 24));
    let mut panels = Vec::new();
    let mut table = heading(&["integrator", "limit of h at k = 10⁴ N/m, theory [ms]", "measured [ms]"]);
    for name in ["semi-implicit-euler", "rk4"] {
        let method = Method {
            contact: law("penalty")?,
            integrator: integrator(name)?,
            timestep: 1e-3,
            rounds: penny::forward::ROUNDS,
        };
        let setting = Setting { case: case.clone(), method };
        let found = map::map(&setting, axes, &centres(&x), &centres(&y), || {});
        let set = |h: f64, k: f64| map::at(&setting, axes, [h, k]);
        let by_theory = |k: f64| map::boundary(STEPS, |h| map::predicted(&set(h, k)).is_some_and(|r| r <= 1.0 + 1e-12));
        // Runs are looked at from half of the theory's limit on; the cells show those below.
        let by_run = |k: f64| {
            let half = 0.5 * by_theory(k)?;
            map::boundary([half, STEPS[1]], |h| !map::unstable(map::classify(&set(h, k))))
        };
        let curve = y.iter().filter_map(|&k| Some([by_theory(k)?, k])).collect::<Vec<_>>();
        let dots = y.iter().step_by(3).filter_map(|&k| Some([by_run(k)?, k])).collect();
        let ms = |x: Option<f64>| x.map_or("none".to_owned(), |h| format!("{:.1}", 1e3 * h));
        table += &row(&[name.into(), ms(by_theory(1e4)), ms(by_run(1e4))]);
        let colors = found.classes.iter().map(|c| CLASSES[*c as usize]).collect();
        let layers = vec![
            Layer::Cells(Cells { x: x.clone(), y: y.clone(), colors }),
            Layer::Line(Line::new("", INK, curve.clone()).over().wide(5.0)),
            Layer::Line(Line::new("", PAPER, curve).over().wide(2.5)),
            Layer::Line(Line::new("", INK, dots).over().wide(0.0).marked(Marker::Circle)),
        ];
        panels.push(Panel::new(name, Axis::log(axes[0].label).tight(), Axis::log("stiffness k [N/m]").tight(), layers));
    }
    let subtitle = "A ball of 1 kg dropped from 1 cm, damping ratio 0.2. White: limit by theory; dots: as measured.";
    let mut figure = Figure::new("Where a contact stays stable", subtitle, panels);
    figure.panel_size = [280.0, 260.0];
    figure.legend = Class::ALL.iter().map(|c| (CLASSES[*c as usize], c.name().to_owned())).collect();
    chapter.figures.push(("stability.svg", figure));
    chapter.text += &format!(
        "
## Where it blows up

A contact is a damped spring, and each integrator has a largest step that it bears: for semi-implicit Euler
(h ω)² + 4 ζ h ω < 4. The map runs a ball of 1 kg on springs over four decades; theory needs no run.

A contact is a spring on one side only, though. A ball comes down between two steps and meets the spring late, so that
it is thrown up higher than it fell: its hops gain energy somewhat before the spring alone would.

{table}
![map of stability](trade/stability.svg)

`penny sweep SCENE --map timestep,stiffness` draws it for any scene, and `penny run` warns before the first step when
the timestep is beyond the limit.
"
    );
    Ok(())
}

/// What no timestep mends: the contact model.
fn laws(chapter: &mut Chapter) -> Result<()> {
    let records: Vec<Record> = serde_json::from_str(include_str!("../../tests/golden/validation.json"))?;
    let mut table = heading(&["case", "truth", "MuJoCo 4.0.0 off by", "`penalty` off by"]);
    for name in [
        "sphere: end of slip",
        "sphere: speed after sliding",
        "rolling resistance, 0.001 m",
        "rolling resistance, 0.0001 m",
        "block that sticks at 20°: speed",
        "block that slides at 35°: in contact",
        "block that slides at 35°: path by steps",
        "Euler's disk: period",
        "SimBenchmark's rolling: velocity error squared",
    ] {
        let record = records.iter().find(|r| r.name == name).ok_or_else(|| format!("no case {name}"))?;
        let ready = record.ready()?;
        let method = ready.method(law("penalty")?).ok_or("unknown integrator")?;
        let off = |value: f64| match (value - record.exact).abs() {
            e if e < 1e-9 => "less than 10⁻⁹".to_owned(),
            e => number(e),
        };
        let quantity = format!("{name} — {}", ready.truth.quantity);
        table += &row(&[quantity, format!("{:.4}", record.exact), off(record.mujoco), off(ready.value(&method))]);
    }
    let hop = hop(&records)?;
    chapter.figures.push(("sliding.svg", hop));
    chapter.text += &format!(
        "
## What no timestep mends

MuJoCo's friction is soft and its slip pushes bodies off the ground, so some answers stay wrong however small the
step. The `penalty` law keeps MuJoCo's normal force and makes friction Coulomb's. All at the scene's own timestep:

{table}
![share of the weight that the ground carries](trade/sliding.svg)

`cargo run --release --example validate` prints all {} closed forms with truth, MuJoCo, and every law; the misses
stay in that table.
",
        records.len()
    );
    Ok(())
}

/// Normal force on a block that slides down a slope of 35°, under two laws.
fn hop(records: &[Record]) -> Result<Figure> {
    let record = records.iter().find(|r| r.name == "block that slides at 35°: in contact").ok_or("no such case")?;
    let ready = record.ready()?;
    let weight = 9.81 * 35f64.to_radians().cos();
    let mut curves = Vec::new();
    for (i, name) in ["mujoco", "penalty"].into_iter().enumerate() {
        let method = ready.method(law(name)?).ok_or("unknown integrator")?;
        let (mut state, mut data, mut points) = (ready.case.start.clone(), Data::new(&ready.case.model), Vec::new());
        while state.time < 0.5 {
            step(&ready.case.model, &method, &mut state, &mut data).map_err(|d| d.to_string())?;
            points.push([state.time, data.contacts.iter().map(|c| c.force[0]).sum::<f64>() / weight]);
        }
        curves.push(Layer::Line(Line::new(name, CURVES[1 - i], points).dashed(DASHES[0]).wide(1.5)));
    }
    let ideal = Line::new("", GREY, vec![[0.0, 1.0], [0.5, 1.0]]).dashed(DASHES[1]).wide(1.0);
    curves.push(Layer::Line(ideal));
    let panel = Panel::new("", Axis::linear("time [s]").tight(), Axis::linear("normal force, weight = 1"), curves);
    let subtitle =
        "A block slides down 35°, μ = 0.5, h = 2 ms. MuJoCo's model throws it off the slope again and again.";
    Ok(Figure::new("A sliding block should stay on its slope", subtitle, vec![panel]))
}
