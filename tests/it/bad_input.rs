//! Bad input: every file under tests/mjcf/bad gives exactly the report beside it.
//!
//! `UPDATE_EXPECT=1 cargo test bad_input` writes the reports anew; look at the difference before committing it.

use std::path::{Path, PathBuf};

use penny::compile;
use penny::mjcf::{self, Document, Problem};

const FOLDER: &str = "tests/mjcf/bad";

/// What a user sees in the repository's folder: all problems of a file, warnings too.
fn report(path: &Path) -> String {
    whole_report(path).replace(&format!("{}/", crate::ROOT), "")
}

fn whole_report(path: &Path) -> String {
    let loaded = match mjcf::load(path) {
        Err(failure) => return failure.to_string(),
        Ok(loaded) => loaded,
    };
    let mut problems = loaded.warnings;
    match compile::compile(&loaded.document, &loaded.spec) {
        Err(errors) => problems.extend(errors),
        Ok((_, warnings)) => problems.extend(warnings),
    }
    mjcf::render(&loaded.document, &problems, false)
}

/// The file with the expected report, and the path to read.
fn cases() -> Vec<(PathBuf, PathBuf)> {
    let folder = crate::file(FOLDER);
    let mut paths: Vec<PathBuf> = std::fs::read_dir(&folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == "xml"))
        .collect();
    paths.sort();
    let mut cases: Vec<_> = paths.into_iter().map(|path| (path.with_extension("txt"), path)).collect();
    cases.push((folder.join("folder.txt"), folder.clone()));
    cases.push((folder.join("missing_file.txt"), folder.join("no_such_file.xml")));
    cases.push((folder.join("misspelt_file.txt"), folder.join("parts/goem.xml")));
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

fn penny(args: &[&str]) -> (Option<i32>, String) {
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_penny"));
    let output = command.args(args).current_dir(crate::ROOT).output().expect("penny starts");
    (output.status.code(), crate::said(&output))
}

#[test]
fn check_ends_with_how_much_it_found() {
    let file = |name: &str| format!("{FOLDER}/{name}.xml");
    let (doubtful, slips, utf16) = (file("doubtful_numbers"), file("number_slips"), file("utf16"));
    let (code, text) = penny(&["check", &doubtful, &slips, &utf16, "models/disk.xml"]);
    assert_eq!(code, Some(1), "{text}");
    let counts = ["fine, with 11 warnings", "12 errors, 1 warning", "1 error", "fine"];
    for (path, count) in [&doubtful, &slips, &utf16, "models/disk.xml"].into_iter().zip(counts) {
        let line = format!("{path}: {count}");
        assert!(text.lines().any(|l| l == line), "`{line}` is missing in:\n{text}");
    }
}

#[test]
fn a_misspelt_integrator_gets_the_nearest_as_a_tip() {
    let run = |name| penny(&["models/disk.xml", "--steps", "1", "--integrator", name]);
    for (name, tip) in [("euler", "Euler"), ("RK5", "rk4"), ("implicitfst", "implicitfast")] {
        let (code, text) = run(name);
        assert_eq!(code, Some(2), "{name}: {text}");
        assert!(text.contains(&format!("similar value exists: '{tip}'")), "{name}: {text}");
    }
    for (mjcf, own) in [("Euler", "semi-implicit-euler"), ("RK4", "rk4"), ("implicit", "implicitfast")] {
        let (code, text) = run(mjcf);
        assert!(code == Some(0) && text.contains(&format!("integrator   {own}: ")), "{mjcf}: {text}");
    }
}

/// A small generator of repeatable randomness (xorshift64, Marsaglia 2003).
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % n.max(1) as u64) as usize
    }
}

/// What a slip of the hand leaves: something deleted, doubled, replaced or put in.
fn damaged(text: &str, random: &mut Random) -> String {
    const SCRAPS: &[&str] = &[
        "<",
        ">",
        "/>",
        "</",
        "\"",
        "'",
        "&",
        "&#0;",
        "<!--",
        "-->",
        "<![CDATA[",
        "<?",
        "=",
        " ",
        "\n",
        "-",
        "nan",
        "1e999",
        "\u{0}",
        "é",
        "∞",
        "<body>",
        "</body>",
        "<default class='x'>",
        "<frame>",
        "<freejoint/>",
        "<geom type='mesh'/>",
        "<include file='x'/>",
        "fromto='0 0 0 0 0 1'",
        "solref='1 -1'",
    ];
    let mut chars: Vec<char> = text.chars().collect();
    for _ in 0..1 + random.below(4) {
        let at = random.below(chars.len());
        let end = (at + random.below(30)).min(chars.len());
        match random.below(4) {
            0 => drop(chars.drain(at..end)),
            1 => {
                let copy = chars[at..end].to_vec();
                let to = random.below(chars.len());
                chars.splice(to..to, copy);
            }
            2 => {
                let end = (at + 1).min(chars.len());
                chars.splice(at..end, SCRAPS[random.below(SCRAPS.len())].chars());
            }
            _ => drop(chars.splice(at..at, SCRAPS[random.below(SCRAPS.len())].chars())),
        }
    }
    chars.into_iter().collect()
}

/// Every place must lie in its file, on character boundaries.
fn assert_places(document: &Document, problems: &[Problem], text: &str) {
    for problem in problems {
        for span in std::iter::once(problem.span).chain(problem.related.iter().map(|r| r.0)) {
            let file = &document.files[span.file as usize];
            let inside = file.text.get(span.start as usize..span.end as usize).is_some();
            assert!(inside, "{span:?} of {problem:?} is not in the file\n{text}");
        }
    }
    let report = mjcf::render(document, problems, false);
    for problem in problems {
        assert!(report.contains(problem.kind.code()), "{problem:?} is missing in\n{report}");
    }
}

#[test]
fn damaged_files_never_panic_and_every_place_is_in_the_file() {
    let mut random = Random(0x9E37_79B9_7F4A_7C15);
    let (mut refused, mut accepted) = (0, 0);
    for entry in ["settings.xml", "classes.xml", "planar.xml", "disk.xml"] {
        let path = format!("tests/mjcf/good/{entry}");
        let whole = std::fs::read_to_string(crate::file(&path)).unwrap();
        for _ in 0..1000 {
            let text = damaged(&whole, &mut random);
            match mjcf::parse(&path, &text) {
                Err(failure) => {
                    refused += 1;
                    assert!(!failure.problems.is_empty());
                    assert_places(&failure.document, &failure.problems, &text);
                }
                Ok(loaded) => {
                    accepted += 1;
                    assert_places(&loaded.document, &loaded.warnings, &text);
                    let problems = match compile::compile(&loaded.document, &loaded.spec) {
                        Err(errors) => errors,
                        Ok((_, warnings)) => warnings,
                    };
                    assert_places(&loaded.document, &problems, &text);
                }
            }
        }
    }
    assert!(refused > 1000 && accepted > 100, "the damage tests nothing: {refused} refused, {accepted} accepted");
}

/// A folder of this test's own.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("bad_input").join(name);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// As by MuJoCo 4.0.0.
#[test]
fn an_include_holds_no_elements_and_its_file_some() {
    let folder = folder("includes");
    std::fs::write(folder.join("option.xml"), "<mujocoinclude><option timestep='.001'/></mujocoinclude>").unwrap();
    std::fs::write(folder.join("text.xml"), "<mujocoinclude>text</mujocoinclude>").unwrap();
    let codes = |include: &str| -> Vec<&str> {
        let scene = folder.join("scene.xml");
        std::fs::write(&scene, format!("<mujoco>{include}<worldbody/></mujoco>")).unwrap();
        let problems = mjcf::load(&scene).map_or_else(|failure| failure.problems, |loaded| loaded.warnings);
        problems.iter().map(|problem| problem.kind.code()).collect()
    };
    assert!(codes("<include file='option.xml'/>").is_empty());
    assert!(codes("<include file='option.xml'><option/></include>").contains(&"misplaced-element"));
    assert!(codes("<include file='text.xml'/>").contains(&"include-empty"));
}

#[test]
fn fixes_are_shown_and_made_only_on_request() {
    let folder = folder("fixes");
    let (main, part) = (folder.join("main.xml"), folder.join("part.xml"));
    let text = "<mujoco>\n  <option timestep=\"2ms\" mpr_iterations=\"30\"\n    apirate=\"100\">\n    <flag passive=\"disable\"/>\n  \
                </option>\n  <worldbody>\n    <geon type=\"plane\" size=\"1 1 1\" fricton=\"1 0.1\"></geon>\n  </worldbody>\n  \
                <include file=\"part.xml\"/>\n</mujoco>\n";
    let inner = "<mujoco>\n<worldbody><body><joint tpye=\"slide\"/>\n<geom size=\"O.1, 0.2\" material=\"a&amp;c\" type=\"box\"/>\n\
                 <geom density=\"7.85\" size=\"0.1\" rgba=\"255 0 0 1\"/></body></worldbody>\n<asset><material name=\"a&amp;b\"/></asset></mujoco>\n";
    std::fs::write(&main, text).unwrap();
    std::fs::write(&part, inner).unwrap();
    let scene = main.to_str().unwrap();
    let (code, said) = penny(&["check", "--fix", scene]);
    assert_eq!(code, Some(1), "{said}");
    let hunk = "@@ -1,10 +1,9 @@\n <mujoco>\n-  <option timestep=\"2ms\" mpr_iterations=\"30\"\n-    apirate=\"100\">\n-    <flag \
                passive=\"disable\"/>\n+  <option timestep=\"0.002\" ccd_iterations=\"30\">\n+    <flag spring=\"disable\" \
                damper=\"disable\"/>\n   </option>\n   <worldbody>\n-    <geon type=\"plane\" size=\"1 1 1\" fricton=\"1 \
                0.1\"></geon>\n+    <geom type=\"plane\" size=\"1 1 1\" friction=\"1 0.1\"></geom>\n   </worldbody>\n";
    assert!(said.contains(hunk), "{said}\n{hunk}");
    let read = |path: &Path| std::fs::read_to_string(path).unwrap();
    assert_eq!([read(&main), read(&part)], [text, inner], "nothing is written");
    // What is left is for a person to decide: two numbers for three.
    let (code, said) = penny(&["check", "--fix", "--write", scene]);
    assert!(code == Some(1) && said.contains("main.xml: 1 error"), "{said}");
    let fixed = "<body><joint type=\"slide\"/>\n<geom size=\"O.1, 0.2\" material=\"a&amp;b\" type=\"box\"/>\n\
                 <geom density=\"7850\" size=\"0.1\" rgba=\"1 0 0 1\"/></body>";
    assert!(read(&part).contains(fixed), "{}", read(&part));
    assert!(read(&main).contains("<geom type=\"plane\" size=\"1 1 1\" friction=\"1 0.1\"></geom>"), "{}", read(&main));
    let (code, _) = penny(&["check", "--write", scene]);
    assert_eq!(code, Some(2), "--write alone");
}

#[test]
fn what_is_fixed_is_no_longer_wrong() {
    for (_, path) in cases() {
        let problems_of = |name: &str, text: &str| match penny::parse(name, text) {
            Ok(scene) => (scene.document, scene.warnings),
            Err(failure) => (failure.document, failure.problems),
        };
        let Ok(text) = std::fs::read_to_string(&path) else { continue };
        let name = path.display().to_string();
        let (document, problems) = problems_of(&name, &text);
        let Some(fixed) = mjcf::fixed(&document, &problems).into_iter().find(|fixed| fixed.file == 0) else { continue };
        let count = |problems: &[Problem]| problems.iter().filter(|p| !p.fix.is_empty() && p.span.file == 0).count();
        let (again, left) = problems_of(&name, &fixed.text);
        // A mended name can show what it had hidden.
        assert!(count(&left) < count(&problems), "{name}:\n{}\n{}", fixed.text, mjcf::render(&again, &left, false));
        assert!(fixed.diff(&document).lines().count() > 5, "{name}");
    }
}

/// A fix neither writes an attribute twice nor takes a derivative's gain for a position's.
#[test]
fn a_misspelt_name_is_none_that_is_there_already() {
    let xml = |names: [&str; 3]| {
        let [first, second, third] = names;
        format!(
            r#"<mujoco><worldbody><body><joint name="j"/><geom size=".1" mass="1" {third}="2"/></body></worldbody><actuator>
            <position joint="j" {first}="1"/><position joint="j" kp="9" {second}="1"/></actuator></mujoco>"#
        )
    };
    let failure = penny::parse("names.xml", &xml(["kd", "kd", "mas"])).expect_err("misspelt");
    let fixed = &mjcf::fixed(&failure.document, &failure.problems)[0].text;
    assert_eq!(*fixed, xml(["kv", "kv", "mas"]));
}

/// What refers to something whose own name or element is misspelt means that, not something else with a name alike.
#[test]
fn a_fix_mends_what_is_misspelt_and_not_what_refers_to_it() {
    let right = "<mujoco><default><default class='a1'/><default class='a2'/></default><worldbody><body>
        <joint name='j1' class='a1'/><joint name='j2' axis='1 0 0' class='a2'/><geom size='.1' pos='.2 0 0'/></body></worldbody>
        <actuator><motor name='m1' joint='j1'/><motor name='m2' joint='j2'/></actuator>
        <sensor><actuatorfrc actuator='m1'/></sensor></mujoco>";
    for (good, bad) in [
        ("<joint name='j1'", "<joint nmae='j1'"),
        ("<motor name='m1'", "<motor Name='m1'"),
        ("<default class='a1'", "<default clas='a1'"),
        ("<actuator>", "<actuatr>"),
        ("</actuator>", "</actuatr>"),
        ("<worldbody>", "<Worldbody>"),
        ("<mujoco>", "<mujco>"),
    ] {
        let wrong = right.replace(good, bad);
        let failure = penny::parse("scene.xml", &wrong).expect_err(bad);
        assert_eq!(mjcf::fixed(&failure.document, &failure.problems)[0].text, right, "{bad}");
    }
    // What differs in its number only is missing, not misspelt.
    let failure = penny::parse("scene.xml", &right.replace("joint='j2'", "joint='j3'")).expect_err("j3");
    assert!(
        failure.to_string().contains("did you mean") && mjcf::fixed(&failure.document, &failure.problems).is_empty()
    );
    // Where nobody knows what was meant, or what it is named is missing in Penny, the reference is not judged.
    for (good, bad) in [("<joint name='j1'", "<zzz name='j1'"), ("<motor name='m1'", "<muscle name='m1'")] {
        let failure = penny::parse("scene.xml", &right.replace(good, bad)).expect_err(bad);
        assert_eq!(failure.problems.len(), 1, "{failure}");
    }
}

#[test]
fn programs_read_problems_as_json_and_sarif() {
    let bad = format!("{FOLDER}/misspelt_attribute.xml");
    let json = |option: &str| {
        let (code, text) = penny(&["check", option, &bad, "models/disk.xml"]);
        assert_eq!(code, Some(1));
        serde_json::from_str::<serde_json::Value>(&text).unwrap_or_else(|e| panic!("{e}: {text}"))
    };
    let own = json("--json");
    let problem = &own["scenes"][0]["problems"][0];
    let expected = |of: &str| problem[of].as_str().unwrap_or_default().to_string();
    assert_eq!(
        [expected("code"), expected("severity"), expected("file")],
        ["unknown-attribute", "error", bad.as_str()]
    );
    let (line, column) = (problem["region"]["startLine"].as_u64(), problem["region"]["startColumn"].as_u64());
    let report = std::fs::read_to_string(crate::file(&bad).with_extension("txt")).unwrap();
    assert!(report.contains(&format!("{bad}:{}:{}\n", line.unwrap(), column.unwrap())), "{problem} {report}");
    assert_eq!(problem["fix"][0]["region"], problem["region"]);
    assert_eq!((&own["scenes"][1]["errors"], &own["scenes"][1]["problems"]), (&0.into(), &serde_json::json!([])));

    let sarif = json("--sarif");
    let run = &sarif["runs"][0];
    assert_eq!((&sarif["version"], &run["tool"]["driver"]["name"]), (&"2.1.0".into(), &"penny".into()));
    let result = &run["results"][0];
    assert_eq!((&result["ruleId"], &result["level"]), (&"unknown-attribute".into(), &"error".into()));
    assert_eq!(result["locations"][0]["physicalLocation"]["artifactLocation"]["uri"], bad);
    assert_eq!(result["locations"][0]["physicalLocation"]["region"], problem["region"]);
    let change = &result["fixes"][0]["artifactChanges"][0]["replacements"][0];
    assert_eq!(change["insertedContent"]["text"], problem["fix"][0]["text"]);
    let rules = run["tool"]["driver"]["rules"].as_array().unwrap();
    assert!(rules.iter().any(|rule| rule["id"] == "unknown-attribute"));
}

#[test]
fn warnings_can_be_denied() {
    let doubtful = format!("{FOLDER}/doubtful_numbers.xml");
    let code = |args: &[&str]| penny(&[&["check"], args].concat()).0;
    assert_eq!(code(&[&doubtful]), Some(0));
    assert_eq!(code(&[&doubtful, "--deny", "warnings"]), Some(1));
    assert_eq!(code(&["models/disk.xml", "--deny", "warnings"]), Some(0));
    assert_eq!(code(&[&doubtful, "--deny", "warnings", "--sarif"]), Some(1));
    assert_eq!(code(&[&doubtful, "--deny", "errors"]), Some(2));
}
