use penny::{
    data::Data,
    forward::{self, Method},
    state::State,
};
fn main() {
    for f in std::env::args().skip(1) {
        let m = penny::load(std::path::Path::new(&f)).unwrap().model;
        for law in ["penalty", "mujoco"] {
            let mut me = Method::of(&m);
            me.contact = penny::contact::by_name(law).unwrap();
            me.integrator = penny::integrate::by_name("semi-implicit-euler").unwrap();
            let (mut s, mut d) = (State::new(&m), Data::new(&m));
            if m.nv == 6 {
                s.qvel[0] = std::env::var("VX").ok().and_then(|v| v.parse().ok()).unwrap_or(0.0);
            }
            let n = (1.0 / me.timestep) as usize;
            for _ in 0..n {
                forward::step(&m, &me, &mut s, &mut d).unwrap();
            }
            let (mut solved, mut systems) = (0, 0);
            for _ in 0..1000 {
                forward::step(&m, &me, &mut s, &mut d).unwrap();
                solved += (d.counts.solves > 0) as usize;
                systems += d.counts.solves;
            }
            println!("{f} {law}: solved {solved} systems {systems}");
        }
    }
}
