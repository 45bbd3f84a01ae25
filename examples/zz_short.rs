use penny::{
    data::Data,
    forward::{self, Method},
    state::State,
};
fn main() {
    let above = |geom: &str, z: f64| format!("<body pos='.01 0 {z}'><freejoint/><geom {geom}/></body>");
    let groove = "<geom type='box' size='.1 9 .1' pos='.2 0 .1' euler='0 -20 0'/><geom type='box' size='.1 9 .1' pos='-.2 0 .1' euler='0 20 0'/>";
    for (shape, more, condim) in [
        ("type='box' size='.1 .1 .1'", above("type='box' size='.08 .1 .05'", 0.25), 3),
        ("type='box' size='.1 .1 .1'", above("size='.1' condim='4'", 0.3), 6),
        ("type='box' size='.1 .1 .1'", above("size='.1'", 0.3), 1),
        ("size='.1'", groove.to_string(), 3),
    ] {
        for (floor, cone, tilt) in [("plane", "elliptic", 0.0), ("box", "elliptic", 4.0), ("plane", "pyramidal", -2.5)]
        {
            let xml = format!(
                "<mujoco><option cone='{cone}' gravity='{tilt} 0 -9.81'/><default><geom condim='{condim}'/></default><worldbody><body pos='0 0 .101'><freejoint/><geom {shape}/></body>{more}<geom type='{floor}' size='9 9 .1' pos='0 0 {}'/></worldbody></mujoco>",
                if floor == "box" { -0.1 } else { 0.0 }
            );
            let m = penny::parse("x", &xml).unwrap().model;
            let mut me = Method::of(&m);
            me.contact = penny::contact::by_name("penalty").unwrap();
            let (mut s, mut d) = (State::new(&m), Data::new(&m));
            let mut z = [0; 6];
            let mut last = 0.0;
            for i in 0..3000 {
                forward::step(&m, &me, &mut s, &mut d).unwrap();
                if d.solver.iterations == 0 {
                    z[i / 500] += 1;
                }
                last = s.qvel.iter().map(|v: &f64| v.abs()).fold(0.0, f64::max);
            }
            println!(
                "{shape} {condim} {floor} {tilt}: {z:?} of 500, vmax {last:e} contacts {} trees {}",
                d.contacts.len(),
                m.trees.len()
            );
        }
    }
}
