//! `penny convert`: a scene as canonical MJCF.

use std::path::{Path, PathBuf};

use super::Failure;
use super::files;
use super::scene::{LimitArgs, read};
use penny::compile::canonical;

#[derive(clap::Args)]
pub struct Args {
    /// An MJCF file
    #[arg(value_name = "SCENE.xml")]
    scene: PathBuf,
    /// The file to write [default: standard output; files are then named as seen from the scene's folder]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    #[command(flatten)]
    limits: LimitArgs,
}

pub fn convert(args: &Args) -> Result<(), Failure> {
    let read = read(&args.scene, &args.limits.limits())?;
    let output = args.output.as_deref().unwrap_or(Path::new("-"));
    files::apart(&read.files, &[("--output", args.output.as_deref())])?;
    if read.count > 0 {
        eprintln!("{}", read.warnings);
    }
    let beside = if output == Path::new("-") { &args.scene } else { output };
    files::write(output, &canonical(&read.document, beside.parent().unwrap_or(Path::new(""))))
}
