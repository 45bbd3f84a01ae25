//! Bad input: every problem is reported at its place, with its cure.

use penny::mjcf;

#[test]
fn a_report_reads_like_the_compilers_we_like() {
    let failure = mjcf::parse("s.xml", "<mujoco>\n <worldbody><geom size=\"1\" fricton=\"1\"/></worldbody>\n</mujoco>")
        .unwrap_err();
    let expected = "\
error[unknown-attribute]: `geom` has no attribute `fricton`
 --> s.xml:2:28
  |
2 |  <worldbody><geom size=\"1\" fricton=\"1\"/></worldbody>
  |                            ^^^^^^^ did you mean `friction`?
";
    assert_eq!(failure.to_string(), expected);
}
