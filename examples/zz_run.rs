use penny::{
    data::Data,
    forward::{self, Method},
    state::State,
};
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let m = penny::load(std::path::Path::new(&a[1])).unwrap().model;
    let mut me = Method::of(&m);
    me.contact = penny::contact::by_name(&a[2]).unwrap();
    me.integrator = penny::integrate::by_name("semi-implicit-euler").unwrap();
    let (mut s, mut d) = (State::new(&m), Data::new(&m));
    let n: usize = a[3].parse().unwrap();
    for _ in 0..n {
        forward::step(&m, &me, &mut s, &mut d).unwrap();
    }
    println!("{:?} {}", s.qpos.iter().take(3).collect::<Vec<_>>(), d.contacts.len());
}
