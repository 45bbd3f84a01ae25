//! The rows of the schema: MJCF 4.0.0, as far as Penny reads it, and what becomes of the rest.
//!
//! Source: MuJoCo 4.0 manual, XML reference; names, defaults and strictness checked by running MuJoCo 4.0.0.

use super::schema::*;

const REAL_WORLD: &str = "worldbody body frame";
const WITH_DEFAULT: &str = "worldbody body frame default";

const ORIENTATION: &[Attribute] = &[
    numbers("quat", 4, "", "1"),
    numbers("axisangle", 4, "", "1, 1, 1, angle"),
    numbers("xyaxes", 6, "", "1"),
    numbers("zaxis", 3, "", "1"),
    numbers("euler", 3, "", "angle"),
];
const POS: Attribute = numbers("pos", 3, "0 0 0", "m");

/// How many numbers each `user` of a kind of element has; −1: as many as the longest.
const fn nuser(name: &'static str) -> Attribute {
    integer(name, "-1").rule(Rule::AtLeast(-1)).without_effect()
}

const NOT_IN_LAW: &str = "the force of contacts would differ";
const NO_TRANSMISSION: &str = "Penny's actuators act on joints, tendons and sites";

/// All elements of MJCF.
pub const SCHEMA: &[Element] = &[
    element("mujoco", "", &[&[text("model")]]),
    element("include", "*", &[&[text("file").required()]]),
    // Settings.
    element(
        "compiler",
        "mujoco",
        &[&[
            // Where files are looked for.
            text("assetdir").without_effect(),
            text("meshdir").without_effect(),
            text("texturedir").without_effect(),
            keyword("strippath", BOOL, "false").without_effect(),
            keyword("angle", &["radian", "degree"], "degree"),
            attribute("eulerseq", Kind::Text, "xyz", ""),
            keyword("autolimits", BOOL, "true"),
            keyword("inertiafromgeom", AUTO, "auto"),
            attribute("inertiagrouprange", Kind::Integers(2, 2), "0 5", ""),
            keyword("balanceinertia", BOOL, "false"),
            number("boundmass", "0", "kg").not_negative(),
            number("boundinertia", "0", "kg m²").not_negative(),
            number("settotalmass", "-1", "kg"),
            keyword("alignfree", BOOL, "false").unsupported("free bodies would keep their frames", "leave it out"),
            keyword("fusestatic", BOOL, "false").unsupported("fixed bodies would stay apart", "leave it out"),
            keyword("coordinate", &["local"], "local").without_effect(),
        ]],
    )
    .and("conflict discardvisual fitaabb passthrough savecanonical savecompiled saveinertial usethread"),
    silent(
        "lengthrange",
        "compiler",
        "accel interval inttotal maxforce mode timeconst timestep tolrange useexisting uselimit",
    )
    .once(),
    element(
        "option",
        "mujoco",
        &[&[
            number("timestep", "0.002", "s").positive().lint(Lint::TooLong(1.0)),
            numbers("gravity", 3, "0 0 -9.81", "m/s²"),
            keyword("integrator", &["Euler", "RK4", "implicit", "implicitfast", "discrete"], "Euler"),
            keyword("cone", &["pyramidal", "elliptic"], "pyramidal"),
            // The three solvers reach the same optimum, so Penny always takes Newton.
            keyword("solver", &["PGS", "CG", "Newton"], "Newton").without_effect(),
            keyword("jacobian", &["dense", "sparse", "auto"], "auto").without_effect(),
            number("impratio", "1", "1").positive(),
            number("tolerance", "1e-8", "1").not_negative(),
            integer("iterations", "100").not_negative(),
            integer("noslip_iterations", "0").not_negative(),
            number("noslip_tolerance", "1e-6", "1").not_negative(),
            number("density", "0", "kg/m³").not_negative(),
            number("viscosity", "0", "Pa s").not_negative(),
            numbers("wind", 3, "0 0 0", "m/s"),
            numbers("magnetic", 3, "0 -0.5 0", "T"),
            number("o_margin", "0", "m"),
            solref("o_solref"),
            solimp("o_solimp"),
            friction("o_friction", 5, "1 1 0.005 0.0001 0.0001", "1, 1, m, m, m"),
            attribute("actuatorgroupdisable", Kind::Integers(0, 31), "", "")
                .unsupported("all actuators would act", "leave the actuators of those groups out"),
        ]],
    )
    // Accuracy of searches that Penny does in closed form or to rounding.
    .and(
        "ls_iterations ls_tolerance ccd_iterations ccd_tolerance sdf_iterations sdf_initpoints \
         sleep_tolerance",
    ),
    element(
        "flag",
        "option",
        &[&[
            flag("constraint", "enable"),
            flag("equality", "enable"),
            flag("frictionloss", "enable"),
            flag("limit", "enable"),
            flag("contact", "enable"),
            flag("spring", "enable"),
            flag("damper", "enable"),
            flag("gravity", "enable"),
            flag("clampctrl", "enable"),
            flag("warmstart", "enable"),
            flag("filterparent", "enable"),
            flag("actuation", "enable"),
            flag("refsafe", "enable"),
            flag("eulerdamp", "enable"),
            flag("diagexact", "disable"),
            flag("sensor", "enable"),
            flag("override", "disable"),
            // Bookkeeping, speed, or features that no scene of Penny has.
            flag("midphase", "enable").without_effect(),
            flag("autoreset", "enable").without_effect(),
            flag("nativeccd", "enable").without_effect(),
            flag("island", "enable"),
            flag("multiccd", "enable").without_effect(),
            flag("energy", "disable").without_effect(),
            flag("fwdinv", "disable").without_effect(),
            flag("invdiscrete", "disable").without_effect(),
            flag("sleep", "disable").unsupported("bodies would not fall asleep", "leave it out"),
            flag("ipc", "disable").unsupported(NOT_IN_LAW, "leave it out"),
            flag("speculative", "disable")
                .unsupported("fast bodies could pass through thin ones", "take a smaller timestep"),
        ]],
    )
    .once(),
    element(
        "size",
        "mujoco",
        &[&[
            integer("nkey", "0").not_negative(),
            nuser("nuser_body"),
            nuser("nuser_jnt"),
            nuser("nuser_geom"),
            nuser("nuser_site"),
            nuser("nuser_cam"),
            nuser("nuser_tendon"),
            nuser("nuser_actuator"),
            nuser("nuser_sensor"),
        ]],
    )
    .and("memory nconmax njmax nstack nuserdata"),
    silent("statistic", "mujoco", "center extent meaninertia meanmass meansize"),
    // Pictures.
    silent("visual", "mujoco", ""),
    silent(
        "global",
        "visual",
        "azimuth bvactive cameraid elevation ellipsoidinertia fovy glow ipd linewidth offheight offwidth orthographic \
         realtime",
    )
    .once(),
    silent("quality", "visual", "numquads numslices numstacks offsamples shadowsize").once(),
    silent("headlight", "visual", "active ambient diffuse specular").once(),
    silent(
        "map",
        "visual",
        "actuatortendon alpha fogend fogstart force haze shadowclip shadowscale stiffness stiffnessrot torque zfar \
         znear",
    )
    .once(),
    silent(
        "scale",
        "visual",
        "actuatorlength actuatorwidth camera com connect constraint contactheight contactwidth forcewidth framelength \
         framewidth frustum jointlength jointwidth light selectpoint slidercrank",
    )
    .once(),
    silent(
        "rgba",
        "visual",
        "actuator actuatornegative actuatorpositive bv bvactive camera com connect constraint contactforce \
         contactfriction contactgap contactpoint contacttorque crankbroken fog force frustum haze inertia joint light \
         rangefinder selectpoint slidercrank",
    )
    .once(),
    // Assets: a geom that needs a mesh or a height field is judged where it stands.
    silent("asset", "mujoco", ""),
    silent(
        "mesh",
        "asset default",
        "builtin content_type face inertia material maxhullvert normal params smoothnormal texcoord vertex",
    )
    .typed(&[&[
        name("mesh"),
        class("class"),
        text("file").without_effect(),
        numbers("scale", 3, "1 1 1", "1").without_effect(),
        numbers("refpos", 3, "0 0 0", "m").without_effect(),
        numbers("refquat", 4, "1 0 0 0", "1").without_effect(),
    ]]),
    silent("hfield", "asset", "content_type elevation file ncol nrow size").typed(&[&[name("height field")]]),
    silent("skin", "asset deformable", "face file group inflate material rgba texcoord vertex")
        .typed(&[&[name("skin")]]),
    silent("bone", "skin", "bindpos bindquat body vertid vertweight"),
    silent(
        "texture",
        "asset default",
        "builtin colorspace content_type embed file fileback filedown filefront fileleft fileright fileup gridlayout \
         gridsize height hflip mark markrgb nchannel random rgb1 rgb2 type vflip width",
    )
    .typed(&[&[name("texture"), class("class")]]),
    silent(
        "material",
        "asset default",
        "emission metallic reflectance rgba roughness shininess specular texrepeat \
 texuniform",
    )
    .typed(&[&[name("material"), class("class"), reference("texture", "texture").in_default()]]),
    silent("layer", "material", "role").typed(&[&[reference("texture", "texture").in_default()]]),
    silent("model", "asset", "content_type file name"),
    silent("plugin", "mesh", "*"),
    silent("config", "plugin", "key value"),
    // Default classes.
    element("default", "mujoco default", &[&[text("class")]]),
    // What Penny cannot use, but other actuators have something from.
    silent("orientation pid muscle adhesion dcmotor", "default", "*").typed(&[ACTUATOR, CTRLLIMITED]).once(),
    element("equality", "default", &[EQUALITY]),
    element("tendon", "default", &[TENDON, DRAWN]).and("group"),
    // Bodies.
    element("worldbody", "mujoco", &[]),
    element(
        "body",
        REAL_WORLD,
        &[
            &[name("body"), class("childclass"), POS],
            ORIENTATION,
            &[keyword("mocap", BOOL, "false"), number("gravcomp", "0", "1"), user()],
        ],
    )
    .and("fuse simple sleep"),
    element(
        "frame",
        "worldbody body frame replicate",
        &[
            &[name("frame").without_effect(), class("childclass"), class("class"), POS],
            ORIENTATION,
            &[
                up_to("scale", 3, "1 1 1", "1")
                    .unsupported("everything inside would keep its size", "scale the numbers inside"),
                number("massscale", "0", "1")
                    .unsupported("everything inside would keep its mass", "scale the masses inside"),
            ],
        ],
    )
    .and("scaling"),
    element(
        "inertial",
        REAL_WORLD,
        &[
            &[POS.required()],
            ORIENTATION,
            &[
                number("mass", "", "kg").not_negative().required(),
                numbers("diaginertia", 3, "", "kg m²").not_negative(),
                numbers("fullinertia", 6, "", "kg m²"),
            ],
        ],
    )
    .once(),
    element(
        "joint",
        WITH_DEFAULT,
        &[&[
            name("joint"),
            class("class"),
            keyword("type", &["free", "ball", "slide", "hinge"], "hinge"),
            POS,
            numbers("axis", 3, "0 0 1", "1"),
            number("ref", "0", "m or angle"),
            number("springref", "0", "m or angle"),
            up_to("stiffness", 3, "0 0 0", "N/m or N m/rad"),
            up_to("damping", 3, "0 0 0", "N s/m or N m s/rad"),
            number("armature", "0", "kg or kg m²").not_negative(),
            number("frictionloss", "0", "N or N m").not_negative(),
            numbers("range", 2, "0 0", "m or angle").may_be_infinite(),
            keyword("limited", AUTO, "auto"),
            number("margin", "0", "m or rad"),
            solref("solreflimit"),
            solimp("solimplimit"),
            solref("solreffriction"),
            solimp("solimpfriction"),
            numbers("springdamper", 2, "0 0", "s, 1"),
            number("springyield", "0", "N or N m").unsupported("the spring would never yield", "leave it out"),
            numbers("actuatorfrcrange", 2, "0 0", "N or N m").may_be_infinite(),
            keyword("actuatorfrclimited", AUTO, "auto"),
            keyword("actuatorgravcomp", BOOL, "false"),
            user(),
        ]],
    )
    .and("group"),
    element("freejoint", REAL_WORLD, &[&[name("joint"), keyword("align", AUTO, "auto")]]).and("group"),
    element(
        "geom",
        WITH_DEFAULT,
        &[
            &[
                name("geom"),
                class("class"),
                keyword(
                    "type",
                    &["plane", "hfield", "sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh", "sdf"],
                    "sphere",
                ),
                up_to("size", 3, "", "m").not_negative(),
                POS,
            ],
            ORIENTATION,
            &[
                numbers("fromto", 6, "", "m"),
                number("mass", "", "kg").not_negative(),
                number("density", "1000", "kg/m³").not_negative().lint(Lint::Density),
                keyword("shellinertia", BOOL, "false"),
                integer("contype", "1"),
                integer("conaffinity", "1"),
                integer("condim", "3").rule(Rule::OneOf(&[1, 3, 4, 6])),
                integer("group", "0"),
                integer("priority", "0"),
                friction("friction", 3, "1 0.005 0.0001", "1, m, m"),
                number("solmix", "1", "1").not_negative(),
                solref("solref"),
                solimp("solimp"),
                number("margin", "0", "m"),
                number("gap", "0", "m"),
                numbers("rgba", 4, "0.5 0.5 0.5 1", "1").lint(Lint::Colour),
                reference("material", "material").in_default(),
                reference("mesh", "mesh").in_default(),
                reference("hfield", "height field").in_default(),
                numbers("surfacevel", 6, "0 0 0 0 0 0", "m/s, rad/s")
                    .unsupported("the surface would not move", "move the body instead"),
                keyword("fluidshape", &["none", "ellipsoid"], "none"),
                up_to("fluidcoef", 5, "0.5 0.25 1.5 1 1", "1").not_negative(),
                number("adhesion", "0", "N").unsupported("contacts would not stick", "leave it out"),
                user(),
            ],
        ],
    )
    // fitscale belongs to meshes.
    .and("castshadow fitscale"),
    element(
        "site",
        WITH_DEFAULT,
        &[
            &[
                name("site"),
                class("class"),
                keyword("type", &["sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh"], "sphere"),
                up_to("size", 3, "0.005 0.005 0.005", "m").not_negative(),
                POS,
            ],
            ORIENTATION,
            &[
                numbers("fromto", 6, "", "m"),
                reference("material", "material").in_default(),
                reference("mesh", "mesh").in_default(),
                user(),
            ],
        ],
    )
    .and("group rgba"),
    element(
        "camera",
        WITH_DEFAULT,
        &[
            &[
                name("camera"),
                class("class"),
                keyword("mode", &["fixed", "track", "trackcom", "targetbody", "targetbodycom"], "fixed"),
                reference("target", "body"),
                number("fovy", "45", "degrees").positive(),
                POS,
            ],
            ORIENTATION,
            &[user()],
        ],
    )
    .and("focal focalpixel ipd output principal principalpixel projection resolution sensorsize"),
    silent(
        "light",
        WITH_DEFAULT,
        "active ambient attenuation bulbradius castshadow cutoff diffuse dir directional exponent intensity mode pos \
         range softness specular type",
    )
    .typed(&[&[name("light"), class("class"), reference("target", "body"), reference("texture", "texture")]]),
    unsupported("plugin", "body geom", "its forces and shapes would be missing", "leave it out"),
    unsupported("flexcomp", "worldbody body frame", "the deformable body would be missing", "use rigid bodies"),
    unsupported("attach", "worldbody body frame", "the attached model would be missing", "use `include`"),
    // Expanded before anything is read: what stands in it are frames, a replica each.
    element(
        "replicate",
        REAL_WORLD,
        &[&[
            integer("count", "").not_negative().required(),
            text("sep"),
            numbers("offset", 3, "0 0 0", "m"),
            numbers("euler", 3, "0 0 0", "angle"),
        ]],
    ),
    unsupported("composite", REAL_WORLD, "MuJoCo 4.0 has removed it too", "write the bodies out"),
    // Contacts.
    element("contact", "mujoco", &[]),
    element(
        "pair",
        "contact default",
        &[&[
            name("pair").without_effect(),
            class("class"),
            reference("geom1", "geom").required(),
            reference("geom2", "geom").required(),
            integer("condim", "3").rule(Rule::OneOf(&[1, 3, 4, 6])),
            friction("friction", 5, "1 1 0.005 0.0001 0.0001", "1, 1, m, m, m"),
            solref("solref"),
            up_to("solreffriction", 2, "0 0", "s, 1 or −1/s², −1/s"),
            solimp("solimp"),
            number("margin", "0", "m"),
            number("gap", "0", "m"),
            number("adhesion", "0", "N").unsupported("contacts would not stick", "leave it out"),
        ]],
    ),
    element(
        "exclude",
        "contact",
        &[&[
            name("exclude").without_effect(),
            reference("body1", "body").required(),
            reference("body2", "body").required(),
        ]],
    ),
    // Actuators.
    element("actuator", "mujoco", &[]),
    element("motor", "actuator default", &[ACTUATOR, CTRLLIMITED]).and("group interp"),
    element(
        "position",
        "actuator default",
        &[
            ACTUATOR,
            CTRLLIMITED,
            &[
                number("kp", "1", "N/m or N m/rad"),
                number("kv", "0", "N s/m or N m s/rad").not_negative(),
                number("dampratio", "0", "1").not_negative(),
                number("timeconst", "0", "s").not_negative(),
                number("inheritrange", "0", "1").not_negative(),
            ],
        ],
    )
    .and("group interp"),
    element("velocity", "actuator default", &[ACTUATOR, CTRLLIMITED, &[number("kv", "1", "N s/m or N m s/rad")]])
        .and("group interp"),
    element(
        "intvelocity",
        "actuator default",
        &[
            ACTUATOR,
            CTRLLIMITED,
            &[
                number("kp", "1", "N/m or N m/rad"),
                number("kv", "0", "N s/m or N m s/rad").not_negative(),
                number("dampratio", "0", "1").not_negative(),
                numbers("actrange", 2, "0 0", "m or rad").may_be_infinite(),
                keyword("actlimited", AUTO, "auto"),
                number("inheritrange", "0", "1").not_negative(),
            ],
        ],
    )
    .and("group interp"),
    element("damper", "actuator default", &[ACTUATOR, &[number("kv", "0", "N s/m or N m s/rad").not_negative()]])
        .and("group interp"),
    element(
        "cylinder",
        "actuator default",
        &[
            ACTUATOR,
            CTRLLIMITED,
            &[
                number("timeconst", "1", "s"),
                number("area", "1", "m²"),
                number("diameter", "0", "m").not_negative(),
                numbers("bias", 3, "0 0 0", "N, N/m, N s/m"),
            ],
        ],
    )
    .and("group interp"),
    element(
        "general",
        "actuator default",
        &[
            ACTUATOR,
            CTRLLIMITED,
            &[
                keyword(
                    "dyntype",
                    &["none", "integrator", "filter", "filterexact", "pid", "dcmotor", "muscle", "user"],
                    "none",
                ),
                keyword("gaintype", &["fixed", "affine", "muscle", "dcmotor", "pid", "so3", "user"], "fixed"),
                keyword("biastype", &["none", "affine", "muscle", "dcmotor", "so3", "user"], "none"),
                up_to("dynprm", 10, "1 0 0 0 0 0 0 0 0 0", ""),
                up_to("gainprm", 10, "1 0 0 0 0 0 0 0 0 0", ""),
                up_to("biasprm", 10, "0 0 0 0 0 0 0 0 0 0", ""),
                numbers("actrange", 2, "0 0", "").may_be_infinite(),
                keyword("actlimited", AUTO, "auto"),
                keyword("actearly", BOOL, "false"),
                integer("actdim", "-1").without_effect(),
                number("inheritrange", "0", "1").not_negative(),
                text("input").without_effect(),
                reference("body", "body").unsupported("the actuator would act on nothing", NO_TRANSMISSION),
            ],
        ],
    )
    .and("group interp velrange ffrange"),
    unsupported(
        "orientation pid muscle adhesion dcmotor plugin",
        "actuator",
        "its force would be missing",
        "use `motor`, `position`, `velocity`, `intvelocity`, `damper`, `cylinder` or `general`",
    ),
    // Sensors.
    element("sensor", "mujoco", &[]),
    element(
        "touch accelerometer velocimeter gyro force torque magnetometer",
        "sensor",
        &[SENSOR, &[reference("site", "site").required()]],
    ),
    element(
        "rangefinder",
        "sensor",
        &[
            SENSOR,
            &[
                reference("site", "site"),
                reference("camera", "camera").ignored("Penny has no cameras that measure"),
                attribute("data", Kind::Text, "dist", "").ignored("Penny gives the distance only"),
            ],
        ],
    ),
    element(
        "jointpos jointvel jointactuatorfrc ballquat ballangvel jointlimitpos jointlimitvel jointlimitfrc",
        "sensor",
        &[SENSOR, &[reference("joint", "joint").required()]],
    ),
    element(
        "actuatorpos actuatorvel actuatorfrc",
        "sensor",
        &[SENSOR, &[reference("actuator", "actuator").required()]],
    ),
    element(
        "framepos framequat framexaxis frameyaxis framezaxis framelinvel frameangvel",
        "sensor",
        &[SENSOR, OBJECT, &[keyword("reftype", FRAMES, ""), reference_by("refname", "reftype")]],
    ),
    element("framelinacc frameangacc", "sensor", &[SENSOR, OBJECT]),
    element("subtreecom subtreelinvel subtreeangmom", "sensor", &[SENSOR, &[reference("body", "body").required()]]),
    element(
        "insidesite",
        "sensor",
        &[
            SENSOR,
            OBJECT,
            &[
                reference("site", "site").required(),
                keyword("enclosed", BOOL, "false").ignored("Penny asks only whether the origin is inside"),
            ],
        ],
    ),
    element(
        "tendonpos tendonvel tendonactuatorfrc tendonlimitpos tendonlimitvel tendonlimitfrc",
        "sensor",
        &[SENSOR, &[reference("tendon", "tendon").required()]],
    ),
    element("e_potential e_kinetic clock", "sensor", &[SENSOR]),
    silent(
        "camprojection distance \
         normal fromto contact tactile user plugin",
        "sensor",
        "body1 body2 camera cutoff data datatype delay dim geom geom1 geom2 instance interp interval mesh needstage \
         noise nsample num objname objtype plugin reduce refname reftype site subtree1 subtree2 tendon user",
    )
    .typed(&[&[name("sensor")]])
    .ignored("Penny does not measure this; the other sensors are not affected"),
    // Equalities.
    element("equality", "mujoco", &[]),
    element("connect", "equality", &[NAMED_EQUALITY, EQUALITY, BODIES, &[numbers("anchor", 3, "0 0 0", "m")]]),
    element(
        "weld",
        "equality",
        &[
            NAMED_EQUALITY,
            EQUALITY,
            BODIES,
            &[
                numbers("anchor", 3, "0 0 0", "m"),
                numbers("relpose", 7, "0 1 0 0 0 0 0", "m, m, m, 1"),
                number("torquescale", "1", "m"),
            ],
        ],
    ),
    element(
        "joint",
        "equality",
        &[NAMED_EQUALITY, EQUALITY, &[reference("joint1", "joint").required(), reference("joint2", "joint"), POLYCOEF]],
    ),
    element(
        "tendon",
        "equality",
        &[
            NAMED_EQUALITY,
            EQUALITY,
            &[reference("tendon1", "tendon").required(), reference("tendon2", "tendon"), POLYCOEF],
        ],
    ),
    unsupported("flex flexstrain", "equality", "Penny has no deformable bodies that it could hold", "use rigid bodies"),
    // Tendons.
    element("tendon", "mujoco", &[]),
    element("fixed", "tendon", &[&[name("tendon"), class("class")], TENDON]).and("group"),
    element("joint", "fixed", &[&[reference("joint", "joint").required(), number("coef", "", "1").required()]]),
    element("spatial", "tendon", &[&[name("tendon"), class("class")], TENDON, DRAWN]).and("group"),
    element("site", "spatial", &[&[reference("site", "site").required()]]),
    element("geom", "spatial", &[&[reference("geom", "geom").required(), reference("sidesite", "site")]]),
    element("pulley", "spatial", &[&[number("divisor", "", "1").positive().required()]]),
    unsupported("deformable", "mujoco", "the deformable bodies would be missing", "use rigid bodies"),
    unsupported("extension", "mujoco", "its plugins would be missing", "leave it out"),
    // Data.
    element("custom", "mujoco", &[]),
    element(
        "numeric",
        "custom",
        &[&[name("numeric").required(), integer("size", "0").not_negative(), list("data", "")]],
    ),
    element("text", "custom", &[&[name("text").required(), text("data").required()]]),
    silent("tuple", "custom", "").typed(&[&[name("tuple").required()]]),
    silent("element", "tuple", "objname objtype prm"),
    element("keyframe", "mujoco", &[]),
    element(
        "key",
        "keyframe",
        &[&[
            name("keyframe"),
            number("time", "0", "s"),
            list("qpos", "m, 1, rad"),
            list("qvel", "m/s, rad/s"),
            list("ctrl", ""),
            list("act", ""),
            list("mpos", "m"),
            list("mquat", "1"),
        ]],
    )
    .and("plastic"),
];

const TENDON: &[Attribute] = &[
    numbers("range", 2, "0 0", "m").may_be_infinite(),
    keyword("limited", AUTO, "auto"),
    number("margin", "0", "m"),
    solref("solreflimit"),
    solimp("solimplimit"),
    solref("solreffriction"),
    solimp("solimpfriction"),
    up_to("stiffness", 3, "0 0 0", "N/m, N/m², N/m³"),
    up_to("springlength", 2, "-1 -1", "m"),
    number("springyield", "0", "N").unsupported("the spring would never yield", "leave it out"),
    up_to("damping", 3, "0 0 0", "N s/m, N s²/m², N s³/m³"),
    number("frictionloss", "0", "N").not_negative(),
    number("armature", "0", "kg").not_negative(),
    numbers("actuatorfrcrange", 2, "0 0", "N").may_be_infinite(),
    keyword("actuatorfrclimited", AUTO, "auto"),
    user(),
];
const DRAWN: &[Attribute] = &[
    number("width", "0.003", "m").not_negative(),
    numbers("rgba", 4, "0.5 0.5 0.5 1", "1").lint(Lint::Colour),
    reference("material", "material").in_default(),
];

const NAMED_EQUALITY: &[Attribute] = &[name("equality"), class("class")];
const EQUALITY: &[Attribute] = &[keyword("active", BOOL, "true"), solref("solref"), solimp("solimp")];
const BODIES: &[Attribute] =
    &[reference("body1", "body"), reference("body2", "body"), reference("site1", "site"), reference("site2", "site")];
const POLYCOEF: Attribute = up_to("polycoef", 5, "0 1 0 0 0", "");

const FRAMES: &[&str] = &["body", "xbody", "geom", "site", "camera"];
const OBJECT: &[Attribute] =
    &[keyword("objtype", FRAMES, "").required(), reference_by("objname", "objtype").required()];
const SENSOR: &[Attribute] = &[
    name("sensor"),
    number("cutoff", "0", "").not_negative(),
    number("noise", "0", "").not_negative(),
    number("delay", "0", "s").ignored("the values come without delay"),
    numbers("interval", 2, "0 0", "s").ignored("the values come in every step"),
    integer("nsample", "0").without_effect(),
    keyword("interp", &["zoh", "linear", "cubic"], "zoh").without_effect(),
    user(),
];

const CTRLLIMITED: &[Attribute] = &[keyword("ctrllimited", AUTO, "auto")];

const ACTUATOR: &[Attribute] = &[
    name("actuator"),
    class("class"),
    reference("joint", "joint"),
    reference("jointinparent", "joint"),
    reference("tendon", "tendon"),
    reference("site", "site"),
    reference("refsite", "site"),
    reference("slidersite", "site"),
    reference("cranksite", "site"),
    numbers("lengthrange", 2, "0 0", "").may_be_infinite().without_effect(),
    up_to("gear", 6, "1 0 0 0 0 0", ""),
    numbers("ctrlrange", 2, "0 0", "").may_be_infinite(),
    numbers("forcerange", 2, "0 0", "N or N m").may_be_infinite(),
    keyword("forcelimited", AUTO, "auto"),
    up_to("damping", 3, "0 0 0", "N s/m or N m s/rad").not_negative(),
    number("armature", "0", "kg or kg m²").not_negative(),
    number("delay", "0", "s").unsupported("the control signal would not be delayed", "leave it out"),
    integer("nsample", "0").without_effect(),
    number("cranklength", "0", "m"),
    user(),
];
