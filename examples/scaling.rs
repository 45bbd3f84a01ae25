//! What a step costs with more bodies, and with more worlds: nanoseconds a body (a world), peak memory, and the slopes.
//!
//!     cargo run --release --example scaling [-- docs/pictures/scaling.svg]
//!
//! Spheres on a plane, apart or in bins where each touches its neighbours; and worlds of one rolling sphere in a batch. Each
//! number comes from a process of its own, so that its peak of memory is its own.

use std::error::Error;
use std::fmt::Write;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use penny::{Batch, Simulation};
use penny_lab::plot::{self, Axis, Figure, Layer, Line, Panel, palette};

type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// Bodies or worlds.
const COUNTS: [usize; 9] = [1, 3, 10, 30, 100, 300, 1000, 3000, 10_000];
/// Steps to let things settle, and the wall time to measure for, s.
const SETTLE: usize = 300;
const MEASURE: f64 = 0.3;
/// A count whose steps take longer is the last, s.
const PATIENCE: f64 = 0.3;

/// What there is more and more of, and the law.
const KINDS: [(&str, &str); 4] = [
    ("spheres apart", "penalty"),
    ("spheres in one pile", "penalty"),
    ("spheres in one pile", "mujoco"),
    ("worlds of a rolling sphere", "penalty"),
];

/// Spheres of 10 cm, half a metre apart; or touching, in a bin as wide as high.
fn scene(kind: &str, n: usize) -> String {
    let mut text = String::from("<mujoco><worldbody><geom type='plane' size='500 500 1'/>");
    let pile = kind == KINDS[1].0;
    let side = if pile { (n as f64).cbrt().ceil() } else { (n as f64).sqrt().ceil() } as usize;
    for i in 0..n {
        let (x, y, z) = (i % side, i / side % side, i / side / side);
        let (x, y, z) = if pile {
            // Each layer lies in the gaps of the one below.
            let aside = 0.1 * (z % 2) as f64;
            (0.2 * x as f64 + aside, 0.2 * y as f64 + aside, 0.1 + 0.02f64.sqrt() * z as f64)
        } else {
            (0.5 * x as f64, 0.5 * (i / side) as f64, 0.1)
        };
        let _ = write!(text, "<body pos='{x} {y} {z}'><freejoint/><geom size='.1' mass='1'/></body>");
    }
    if pile {
        let (middle, half, high) = (0.1 * side as f64 - 0.05, 0.1 * side as f64 + 0.05, 0.2 * side as f64 + 1.0);
        for (x, y) in [(-1.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.0, 1.0)] {
            let (px, py) = (middle + x * (half + 0.5), middle + y * (half + 0.5));
            let [width, depth] = [x, y].map(|d| if d == 0.0 { half } else { 0.5 });
            let _ = write!(text, "<geom type='box' pos='{px} {py} {high}' size='{width} {depth} {high}'/>");
        }
    }
    text + "</worldbody></mujoco>"
}

/// Seconds a step of everything, and contacts.
fn measure((kind, law): (&str, &str), n: usize) -> Result<(f64, usize)> {
    let worlds = kind == KINDS[3].0;
    let mut sim = Simulation::from_xml(&scene(kind, if worlds { 1 } else { n }))?;
    sim.set_law(law)?;
    if worlds {
        sim.state_mut().qvel[0] = 1.0;
    }
    let mut batch = Batch::new(&sim, if worlds { n } else { 1 });
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let mut run = |steps: usize| {
        let before = Instant::now();
        let failed = one_thread.install(|| batch.step_n(steps));
        assert_eq!(failed, 0, "{kind}, {n}: it diverges");
        before.elapsed().as_secs_f64() / steps as f64
    };
    if run(3) < PATIENCE {
        run(SETTLE);
    }
    let steps = (MEASURE / 3.0 / run(1)).clamp(1.0, 10_000.0) as usize;
    let best = (0..3).map(|_| run(steps)).fold(f64::INFINITY, f64::min);
    Ok((best, batch.worlds().iter().map(|world| world.data().contacts.len()).sum()))
}

/// The most memory that this process has had, MB, where the system tells.
fn peak() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM"))?;
    Some(line.split_whitespace().nth(1)?.parse::<f64>().ok()? / 1024.0)
}

/// A count and what it costs: seconds a step, contacts, MB.
type Row = [f64; 4];

/// Measures in a process of its own.
fn measure_apart(kind: usize, n: usize) -> Result<Row> {
    let output = Command::new(std::env::current_exe()?).args(["--one", &kind.to_string(), &n.to_string()]).output()?;
    let text = String::from_utf8(output.stdout)?;
    let numbers: Vec<f64> = text.split_whitespace().map(str::parse).collect::<std::result::Result<_, _>>()?;
    let [seconds, contacts, memory] = numbers[..] else {
        return Err(format!("{} of {n}: {}", KINDS[kind].0, String::from_utf8_lossy(&output.stderr)).into());
    };
    Ok([n as f64, seconds, contacts, memory])
}

/// The exponent s of time ~ nˢ between the last rows that are a factor of ten apart.
fn slope(rows: &[Row]) -> f64 {
    let last = rows[rows.len() - 1];
    let first = rows.iter().rev().find(|row| row[0] * 9.9 < last[0]).unwrap_or(&rows[0]);
    (last[1] / first[1]).ln() / (last[0] / first[0]).ln()
}

fn main() -> Result<()> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    if let [one, kind, n] = &args[..]
        && one == "--one"
    {
        let (seconds, contacts) = measure(KINDS[kind.parse::<usize>()?], n.parse()?)?;
        println!("{seconds} {contacts} {}", peak().unwrap_or(f64::NAN));
        return Ok(());
    }
    let mut lines = Vec::new();
    for (k, (kind, law)) in KINDS.iter().enumerate() {
        println!("| {kind}, `{law}` | a step | for each | contacts | peak memory |\n|---|---|---|---|---|");
        let mut rows = Vec::new();
        for n in COUNTS {
            let row = measure_apart(k, n)?;
            let [_, seconds, contacts, memory] = row;
            let (ms, ns) = (seconds * 1e3, seconds / n as f64 * 1e9);
            println!("| {n} | {ms:.4} ms | {ns:.0} ns | {contacts} | {memory:.0} MB |");
            rows.push(row);
            if seconds > PATIENCE {
                break;
            }
        }
        println!("\ntime ~ n^{:.2} over the last factor of ten\n", slope(&rows));
        let points = rows.iter().map(|row| [row[0], row[1]]).collect();
        lines.push(Layer::Line(
            Line::new(format!("{kind}, {law}"), palette::CURVES[k], points).marked(palette::MARKERS[k]),
        ));
    }
    if let Some(path) = args.first() {
        let (x, y) = (Axis::log("bodies or worlds"), Axis::log("a step of all [s]"));
        let figure = Figure::new("What a step costs", "one thread", vec![Panel::new("", x, y, lines)]);
        plot::save(&figure, Path::new(path))?;
    }
    Ok(())
}
