//! Bad input: every file under tests/mjcf/bad gives exactly the report beside it.
//!
//! `UPDATE_EXPECT=1 cargo test bad_input` writes the reports anew; look at the difference before committing it.

use std::path::{Path, PathBuf};

use penny::mjcf;

const FOLDER: &str = "tests/mjcf/bad";

/// What a user sees: all problems of a file, warnings too.
fn report(path: &Path) -> String {
    match mjcf::load(path) {
        Err(failure) => failure.to_string(),
        Ok(loaded) => mjcf::render(&loaded.document, &loaded.warnings, false),
    }
}

/// The file with the expected report, and the path to read.
fn cases() -> Vec<(PathBuf, PathBuf)> {
    let mut paths: Vec<PathBuf> = std::fs::read_dir(FOLDER)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == "xml"))
        .collect();
    paths.sort();
    let mut cases: Vec<_> = paths.into_iter().map(|path| (path.with_extension("txt"), path)).collect();
    cases.push((Path::new(FOLDER).join("folder.txt"), FOLDER.into()));
    cases.push((Path::new(FOLDER).join("missing_file.txt"), Path::new(FOLDER).join("no_such_file.xml")));
    cases
}

/// The lines that differ, those expected with `-`, those found with `+`.
fn difference(expected: &str, found: &str) -> String {
    let (expected, found): (Vec<_>, Vec<_>) = (expected.lines().collect(), found.lines().collect());
    let same = expected.iter().zip(&found).take_while(|(a, b)| a == b).count();
    let tail = expected[same..].iter().rev().zip(found[same..].iter().rev()).take_while(|(a, b)| a == b).count();
    let lines = |sign: char, lines: &[&str]| lines.iter().map(|l| format!("{sign}{l}\n")).collect::<String>();
    lines('-', &expected[same..expected.len() - tail]) + &lines('+', &found[same..found.len() - tail])
}

#[test]
fn every_bad_file_gives_its_report() {
    let update = std::env::var_os("UPDATE_EXPECT").is_some();
    let mut differences = String::new();
    let cases = cases();
    for (expected_file, path) in &cases {
        let found = report(path);
        assert!(!found.is_empty(), "{}: no problem reported", path.display());
        if update {
            std::fs::write(expected_file, &found).unwrap();
        }
        let expected = std::fs::read_to_string(expected_file).unwrap_or_default();
        if expected != found {
            differences += &format!("{}:\n{}\n", expected_file.display(), difference(&expected, &found));
        }
    }
    assert!(cases.len() >= 40, "only {} bad files", cases.len());
    assert!(differences.is_empty(), "reports differ (UPDATE_EXPECT=1 accepts them):\n{differences}");
}
