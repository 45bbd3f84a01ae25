//! The arrays of `MjData` that follow from the state: name, shape, where the numbers are.

use penny::data::Data;
use penny::dynamics::{self, energy};
use penny::math::{Mat3, Quat, Vec3, mat, wxyz};
use penny::model::Model;
use penny::quantities::{self, Motions, Spatial};

use pyo3::prelude::*;

use crate::data::{Core, MjData};
use crate::model_fields::Per;
use crate::values::Type;

/// What an array has a row for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rows {
    Per(Per),
    Activation,
    Sensordata,
    /// Two: potential and kinetic.
    Energy,
    /// Numbers of all rows of actuators' moments.
    Moment,
}

impl Rows {
    pub fn count(self, m: &Model) -> usize {
        match self {
            Rows::Per(per) => per.rows(m),
            Rows::Activation => m.na,
            Rows::Sensordata => m.nsensordata,
            Rows::Energy => 2,
            Rows::Moment => quantities::moment_room(m),
        }
    }
}

/// An array of the data.
pub struct Field {
    pub name: &'static str,
    pub rows: Rows,
    /// Numbers in a row; 1: the array has one dimension.
    pub width: usize,
    pub kind: Type,
    /// All numbers, for the state to which the engine's data belong.
    pub get: fn(&mut Core, &mut Vec<f64>),
}

impl Field {
    pub fn shape(&self, m: &Model) -> Vec<usize> {
        let rows = self.rows.count(m);
        if self.width == 1 { vec![rows] } else { vec![rows, self.width] }
    }
}

const fn per(name: &'static str, per: Per, width: usize, get: fn(&mut Core, &mut Vec<f64>)) -> Field {
    Field { name, rows: Rows::Per(per), width, kind: Type::Real, get }
}

/// Whole numbers, which follow from the rows of actuators' moments.
const fn moments(name: &'static str, rows: Rows, get: fn(&mut Core, &mut Vec<f64>)) -> Field {
    Field { name, rows, width: 1, kind: Type::Int, get }
}

fn each_moment(c: &mut Core) -> Vec<Vec<(usize, f64)>> {
    quantities::moments(&c.model, &c.at, &mut c.data)
}

/// As many numbers as there is room for: those that there are, then zeros.
fn filled(c: &Core, out: &mut Vec<f64>, numbers: impl Iterator<Item = f64>) {
    out.extend(numbers);
    out.resize(quantities::moment_room(&c.model), 0.0);
}

/// Row by row, as MuJoCo has matrices.
fn rows(out: &mut Vec<f64>, m: &Mat3) {
    out.extend(m.transpose().iter());
}

/// Origin and axes of everything on bodies.
fn frames<'a, T: 'a>(
    c: &'a Core,
    list: &'a [T],
    of: fn(&T) -> (usize, &Vec3, &Quat),
) -> impl Iterator<Item = (Vec3, Quat)> + 'a {
    list.iter().map(move |x| {
        let (body, pos, quat) = of(x);
        (c.data.xpos[body] + c.data.xmat[body] * pos, c.data.xquat[body] * quat)
    })
}

fn geoms(c: &Core) -> impl Iterator<Item = (Vec3, Quat)> + '_ {
    frames(c, &c.model.geoms, |g| (g.body, &g.pos, &g.quat))
}

fn sites(c: &Core) -> impl Iterator<Item = (Vec3, Quat)> + '_ {
    frames(c, &c.model.sites, |s| (s.body, &s.pos, &s.quat))
}

fn six(list: &[Spatial], out: &mut Vec<f64>) {
    out.extend(list.as_flattened());
}

fn motions(c: &Core, which: fn(Motions) -> Vec<Spatial>, out: &mut Vec<f64>) {
    six(&which(quantities::motions(&c.model, c.method.contact, &c.at, &c.data)), out);
}

use Per::{Actuator, Body, Camera, Dof, Geom, Joint, Site, Tendon};

/// All of them, as MuJoCo names them.
pub const FIELDS: &[Field] = &[
    per("xpos", Body, 3, |c, out| c.data.xpos.iter().for_each(|v| out.extend(v.iter()))),
    per("xquat", Body, 4, |c, out| c.data.xquat.iter().for_each(|q| out.extend(wxyz(q)))),
    per("xmat", Body, 9, |c, out| c.data.xmat.iter().for_each(|m| rows(out, m))),
    per("xipos", Body, 3, |c, out| {
        (0..c.model.bodies.len()).for_each(|b| out.extend(dynamics::xipos(&c.model, &c.data, b).iter()));
    }),
    per("ximat", Body, 9, |c, out| {
        let axes = |(b, body): (usize, &penny::model::Body)| c.data.xmat[b] * mat(&body.iquat);
        c.model.bodies.iter().enumerate().map(axes).for_each(|m| rows(out, &m));
    }),
    per("xiquat", Body, 4, |c, out| {
        let axes = |(b, body): (usize, &penny::model::Body)| c.data.xquat[b] * body.iquat;
        c.model.bodies.iter().enumerate().map(axes).for_each(|q| out.extend(wxyz(&q)));
    }),
    per("xanchor", Joint, 3, |c, out| c.joint_frames(|anchor, _| out.extend(anchor.iter()))),
    per("xaxis", Joint, 3, |c, out| c.joint_frames(|_, axis| out.extend(axis.iter()))),
    per("geom_xpos", Geom, 3, |c, out| geoms(c).for_each(|(p, _)| out.extend(p.iter()))),
    per("geom_xmat", Geom, 9, |c, out| geoms(c).for_each(|(_, q)| rows(out, &mat(&q)))),
    per("geom_xquat", Geom, 4, |c, out| geoms(c).for_each(|(_, q)| out.extend(wxyz(&q)))),
    per("site_xpos", Site, 3, |c, out| sites(c).for_each(|(p, _)| out.extend(p.iter()))),
    per("site_xmat", Site, 9, |c, out| sites(c).for_each(|(_, q)| rows(out, &mat(&q)))),
    per("site_xquat", Site, 4, |c, out| sites(c).for_each(|(_, q)| out.extend(wxyz(&q)))),
    per("cam_xpos", Camera, 3, |c, out| c.cameras(|pos, _| out.extend(pos.iter()))),
    per("cam_xmat", Camera, 9, |c, out| c.cameras(|_, axes| rows(out, &axes))),
    per("subtree_com", Body, 3, |c, out| {
        quantities::subtree_com(&c.model, &c.data).iter().for_each(|v| out.extend(v.iter()));
    }),
    per("cinert", Body, 10, |c, out| out.extend(quantities::cinert(&c.model, &c.data).as_flattened())),
    per("cdof", Dof, 6, |c, out| six(&quantities::cdof(&c.model, &c.data), out)),
    per("cvel", Body, 6, |c, out| motions(c, |m| m.cvel, out)),
    per("cacc", Body, 6, |c, out| motions(c, |m| m.cacc, out)),
    per("cfrc_ext", Body, 6, |c, out| motions(c, |m| m.cfrc_ext, out)),
    per("cfrc_int", Body, 6, |c, out| motions(c, |m| m.cfrc_int, out)),
    per("subtree_linvel", Body, 3, |c, out| {
        let [linear, _] = quantities::subtree_momentum(&c.model, &c.at, &c.data);
        linear.iter().for_each(|v| out.extend(v.iter()));
    }),
    per("subtree_angmom", Body, 3, |c, out| {
        let [_, angular] = quantities::subtree_momentum(&c.model, &c.at, &c.data);
        angular.iter().for_each(|v| out.extend(v.iter()));
    }),
    per("qacc", Dof, 1, |c, out| out.extend(&c.data.qacc)),
    per("qacc_smooth", Dof, 1, |c, out| out.extend(&c.data.qacc_smooth)),
    per("qfrc_bias", Dof, 1, |c, out| out.extend(quantities::bias(&c.model, &c.at, &c.data))),
    per("qfrc_passive", Dof, 1, |c, out| out.extend(&c.data.qfrc_passive)),
    per("qfrc_actuator", Dof, 1, |c, out| out.extend(&c.data.qfrc_actuator)),
    per("qfrc_gravcomp", Dof, 1, |c, out| out.extend(&c.data.qfrc_gravcomp)),
    per("qfrc_smooth", Dof, 1, |c, out| out.extend(quantities::smooth(&c.model, &c.data))),
    per("qfrc_constraint", Dof, 1, |c, out| out.extend(&c.data.qfrc_constraint)),
    per("qfrc_inverse", Dof, 1, |c, out| out.extend(&c.qfrc_inverse)),
    per("actuator_force", Actuator, 1, |c, out| out.extend(&c.data.actuator_force)),
    per("actuator_length", Actuator, 1, |c, out| out.extend(quantities::actuators(&c.model, &c.at, &c.data).0)),
    per("actuator_velocity", Actuator, 1, |c, out| out.extend(quantities::actuators(&c.model, &c.at, &c.data).1)),
    per("ten_length", Tendon, 1, |c, out| out.extend(&c.data.ten_length)),
    per("ten_velocity", Tendon, 1, |c, out| out.extend(&c.data.ten_velocity)),
    Field {
        name: "actuator_moment",
        rows: Rows::Moment,
        width: 1,
        kind: Type::Real,
        get: |c, out| {
            let rows = each_moment(c);
            filled(c, out, rows.iter().flatten().map(|(_, entry)| *entry));
        },
    },
    moments("moment_rownnz", Rows::Per(Actuator), |c, out| {
        out.extend(each_moment(c).iter().map(|row| row.len() as f64))
    }),
    moments("moment_rowadr", Rows::Per(Actuator), |c, out| {
        out.extend(each_moment(c).iter().scan(0, |at, row| Some(std::mem::replace(at, *at + row.len()) as f64)));
    }),
    moments("moment_colind", Rows::Moment, |c, out| {
        let rows = each_moment(c);
        filled(c, out, rows.iter().flatten().map(|(dof, _)| *dof as f64));
    }),
    Field {
        name: "act_dot",
        rows: Rows::Activation,
        width: 1,
        kind: Type::Real,
        get: |c, out| out.extend(&c.data.act_dot),
    },
    Field {
        name: "sensordata",
        rows: Rows::Sensordata,
        width: 1,
        kind: Type::Real,
        get: |c, out| out.extend(&c.data.sensordata),
    },
    Field {
        name: "energy",
        rows: Rows::Energy,
        width: 1,
        kind: Type::Real,
        get: |c, out| {
            let Core { scratch, model, at, .. } = c;
            let scratch = scratch.get_or_insert_with(|| Data::new(model));
            scratch.follow(model);
            let energy = energy::energy(model, at, scratch);
            out.extend([energy.potential + energy::potential_of_fixed(model, scratch), energy.kinetic]);
        },
    },
];

/// The number of a field, found by the compiler.
const fn position(name: &str) -> usize {
    let mut i = 0;
    while i < FIELDS.len() {
        let (a, b) = (FIELDS[i].name.as_bytes(), name.as_bytes());
        let mut k = 0;
        while k < a.len() && k < b.len() && a[k] == b[k] {
            k += 1;
        }
        if k == a.len() && k == b.len() {
            return i;
        }
        i += 1;
    }
    panic!("no such field")
}

/// The accelerations, which `mj_inverse` reads.
pub const QACC: usize = position("qacc");

/// A property of `MjData` for each field: Python finds it without a failed look-up before.
macro_rules! properties {
    ($($name:ident,)*) => {
        #[pymethods]
        impl MjData {$(
            #[getter]
            fn $name<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
                const AT: usize = position(stringify!($name));
                self.array(py, AT)
            }
        )*}

        /// The same list at run time.
        pub const PROPERTIES: &[&str] = &[$(stringify!($name)),*];
    };
}

properties! {
    xpos, xquat, xmat, xipos, ximat, xiquat, xanchor, xaxis, geom_xpos, geom_xmat, geom_xquat, site_xpos,
    site_xmat, site_xquat, cam_xpos, cam_xmat, subtree_com, cinert, cdof, cvel, cacc, cfrc_ext, cfrc_int, subtree_linvel,
    subtree_angmom, qacc, qacc_smooth, qfrc_bias, qfrc_passive, qfrc_actuator, qfrc_gravcomp, qfrc_smooth,
    qfrc_constraint, qfrc_inverse, actuator_force, actuator_length, actuator_velocity, ten_length, ten_velocity,
    actuator_moment, moment_rownnz, moment_rowadr, moment_colind, act_dot, sensordata, energy,
}

// Every field has its property.
const _: () = assert!(PROPERTIES.len() == FIELDS.len());
