//! The module `penny._penny`: the engine under MuJoCo's Python names. `python/penny/__init__.py` is what users import.
//!
//! | file | what |
//! |---|---|
//! | `array` | NumPy arrays that the engine's numbers are exchanged through: all `unsafe` code |
//! | `values` | arrays with MuJoCo's types and shapes |
//! | `model`, `model_fields`, `option` | `MjModel` and its arrays, `MjOption` |
//! | `data`, `data_fields`, `contact`, `efc` | `MjData` and its arrays, its contacts, the rows of its constraints |
//! | `view` | things by name |
//! | `callback` | a function of Python's in a step |
//! | `functions` | `mj_step` and the others |
//! | `picture` | pictures and videos |
//! | `rollout` | many worlds at once |
//! | `tools` | what is Penny's own |
#![allow(non_snake_case)]

mod array;
mod callback;
mod contact;
mod data;
mod data_fields;
mod efc;
mod functions;
mod model;
mod model_fields;
mod option;
mod picture;
mod rollout;
mod tools;
mod values;
mod view;

/// The compiled part of `penny`.
#[pyo3::pymodule]
mod _penny {
    #[pymodule_export]
    use crate::callback::{get_mjcb_control, set_mjcb_control};
    #[pymodule_export]
    use crate::contact::{Contacts, MjContact};
    #[pymodule_export]
    use crate::data::MjData;
    #[pymodule_export]
    use crate::functions::{
        mj_applyFT, mj_comPos, mj_contactForce, mj_copyData, mj_differentiatePos, mj_energyPos, mj_energyVel,
        mj_forward, mj_fullM, mj_getTotalmass, mj_id2name, mj_integratePos, mj_inverse, mj_jac, mj_jacBody,
        mj_jacBodyCom, mj_jacGeom, mj_jacSite, mj_jacSubtreeCom, mj_kinematics, mj_mulM, mj_name2id, mj_normalizeQuat,
        mj_objectVelocity, mj_ray, mj_resetData, mj_resetDataKeyframe, mj_rnePostConstraint, mj_setConst, mj_step,
        mj_step1, mj_step2, mj_subtreeVel,
    };
    #[pymodule_export]
    use crate::model::MjModel;
    #[pymodule_export]
    use crate::option::MjOption;
    #[pymodule_export]
    use crate::picture::{_depth, _framing, _paint, save_video};
    #[pymodule_export]
    use crate::rollout::_rollout;
    #[pymodule_export]
    use crate::tools::{_chart, check, explain};
    #[pymodule_export]
    use crate::view::View;
}
