"""Whether what `penny check --sarif` writes is SARIF 2.1.0, by the schema of OASIS (as the crate `serde-sarif` has it).

    PENNY=target/debug/penny python tests/sarif/validate.py        # needs cargo, and jsonschema from PyPI

Every scene of models/ and tests/mjcf/ is checked, good and bad ones.
"""

import json
import os
import pathlib
import subprocess
import sys
import tempfile

import jsonschema

ROOT = pathlib.Path(__file__).resolve().parents[2]
PENNY = os.environ.get("PENNY", ROOT / "target/debug/penny")
MANIFEST = """
[package]
name = "schema"
version = "0.1.0"
[lib]
path = "lib.rs"
[dependencies]
serde-sarif = "=0.8.0"
"""


def schema() -> dict:
    """The schema, from the crate's sources."""
    with tempfile.TemporaryDirectory() as folder:
        manifest = pathlib.Path(folder, "Cargo.toml")
        manifest.write_text(MANIFEST)
        pathlib.Path(folder, "lib.rs").touch()
        ask = ["cargo", "metadata", "--quiet", "--format-version", "1", "--manifest-path", manifest]
        packages = json.loads(subprocess.run(ask, stdout=subprocess.PIPE, check=True).stdout)["packages"]
    [crate] = [package for package in packages if package["name"] == "serde-sarif"]
    return json.loads(pathlib.Path(crate["manifest_path"]).with_name("src").joinpath("schema.json").read_text())


def main() -> None:
    rules = schema()
    validator = jsonschema.validators.validator_for(rules)(rules)
    files = sorted([*ROOT.glob("models/*.xml"), *ROOT.glob("tests/mjcf/*/*.xml")])
    assert len(files) > 100, f"only {len(files)} scenes in {ROOT}"
    results = 0
    for file in files:
        ask = [PENNY, "check", "--sarif", file]
        report = subprocess.run(ask, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=False)
        document = json.loads(report.stdout)
        wrong = [f"{file}: {list(error.path)}: {error.message}" for error in validator.iter_errors(document)]
        if wrong:
            sys.exit("\n".join(wrong[:5]))
        results += len(document["runs"][0]["results"])
    print(f"{len(files)} scenes, {results} problems: all valid SARIF 2.1.0")


if __name__ == "__main__":
    main()
