use penny::model::*;
fn main() {
    macro_rules! s(($($t:ty),*)=>{$(println!("{} {}",stringify!($t),std::mem::size_of::<$t>());)*});
    s!(Body, Joint, Dof, Geom, Site, Tree, Mix, Pair, penny::data::Contact);
}
