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

const YES: Kind = Kind::Keyword(BOOL);
const NUMBER: Kind = Kind::Numbers(1, 1);
const WHOLE: Kind = Kind::Integers(1, 1);
// Of a lens; a place, a direction or a colour; a colour and how opaque it is.
const TWO: Kind = Kind::Numbers(2, 2);
const THREE: Kind = Kind::Numbers(3, 3);
const FOUR: Kind = Kind::Numbers(4, 4);
const GROUP: &[Attribute] = &[integer("group", "0").without_effect()];
const TRACKING: &[&str] = &["fixed", "track", "trackcom", "targetbody", "targetbodycom"];

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
        &[
            &[
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
                keyword("conflict", &["warning", "merge", "error"], "warning").without_effect(),
                keyword("passthrough", &["none", "textures"], "none").without_effect(),
            ],
            &silent_all(
                ["discardvisual", "fitaabb", "savecanonical", "savecompiled", "saveinertial", "usethread"],
                YES,
            ),
        ],
    ),
    silent("lengthrange", "compiler", "")
        .typed(&[
            &silent_all(["accel", "interval", "inttotal", "maxforce", "timeconst", "timestep", "tolrange"], NUMBER),
            &silent_all(["useexisting", "uselimit"], YES),
            &[keyword("mode", &["none", "muscle", "muscleuser", "all"], "muscle").without_effect()],
        ])
        .once(),
    element(
        "option",
        "mujoco",
        &[
            &[
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
            ],
            // Accuracy of searches that Penny does in closed form or to rounding.
            &silent_all(["ls_iterations", "ccd_iterations", "sdf_iterations", "sdf_initpoints"], WHOLE),
            &silent_all(["ls_tolerance", "ccd_tolerance", "sleep_tolerance"], NUMBER),
        ],
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
        &[
            &[
                integer("nkey", "0").not_negative(),
                nuser("nuser_body"),
                nuser("nuser_jnt"),
                nuser("nuser_geom"),
                nuser("nuser_site"),
                nuser("nuser_cam"),
                nuser("nuser_tendon"),
                nuser("nuser_actuator"),
                nuser("nuser_sensor"),
            ],
            &silent_all(["nconmax", "njmax", "nstack", "nuserdata"], WHOLE),
        ],
    )
    .and("memory"),
    silent("statistic", "mujoco", "").typed(&[
        &silent_all(["center"], THREE),
        &silent_all(["meaninertia", "meanmass", "meansize"], NUMBER),
        &[number("extent", "", "m").positive().without_effect()],
    ]),
    // Pictures.
    silent("visual", "mujoco", ""),
    silent("global", "visual", "")
        .typed(&[
            &silent_all(["azimuth", "elevation", "fovy", "glow", "ipd", "linewidth"], NUMBER),
            &[number("realtime", "", "1").positive().without_effect()],
            &silent_all(["cameraid", "offheight", "offwidth"], WHOLE),
            &silent_all(["bvactive", "ellipsoidinertia", "orthographic"], YES),
        ])
        .once(),
    silent("quality", "visual", "")
        .typed(&[&silent_all(["numquads", "numslices", "numstacks", "offsamples", "shadowsize"], WHOLE)])
        .once(),
    silent("headlight", "visual", "")
        .typed(&[&silent_all(["ambient", "diffuse", "specular"], THREE), &silent_all(["active"], WHOLE)])
        .once(),
    silent("map", "visual", "")
        .typed(&[
            &silent_all(
                [
                    "actuatortendon", "alpha", "fogend", "fogstart", "force", "haze", "shadowclip", "shadowscale",
                    "stiffness", "stiffnessrot", "torque", "zfar",
                ],
                NUMBER,
            ),
            &[number("znear", "", "1").positive().without_effect()],
        ])
        .once(),
    silent("scale", "visual", "")
        .typed(&[&silent_all(
            [
                "actuatorlength", "actuatorwidth", "camera", "com", "connect", "constraint", "contactheight",
                "contactwidth", "forcewidth", "framelength", "framewidth", "frustum", "jointlength", "jointwidth",
                "light", "selectpoint", "slidercrank",
            ],
            NUMBER,
        )])
        .once(),
    silent("rgba", "visual", "")
        .typed(&[&silent_all(
            [
                "actuator", "actuatornegative", "actuatorpositive", "bv", "bvactive", "camera", "com", "connect",
                "constraint", "contactforce", "contactfriction", "contactgap", "contactpoint", "contacttorque",
                "crankbroken", "fog", "force", "frustum", "haze", "inertia", "joint", "light", "rangefinder",
                "selectpoint", "slidercrank",
            ],
            FOUR,
        )])
        .once(),
    // Assets: a geom that needs a mesh or a height field is judged where it stands.
    silent("asset", "mujoco", ""),
    silent("mesh", "asset default", "builtin content_type material params").typed(&[
        &[
            name("mesh"),
            class("class"),
            text("file").without_effect(),
            numbers("scale", 3, "1 1 1", "1").without_effect(),
            numbers("refpos", 3, "0 0 0", "m").without_effect(),
            numbers("refquat", 4, "1 0 0 0", "1").without_effect(),
            keyword("inertia", &["convex", "exact", "legacy", "shell"], "legacy").without_effect(),
            attribute("face", Kind::Integers(1, usize::MAX), "", "").without_effect(),
        ],
        &silent_all(["normal", "texcoord", "vertex"], Kind::Numbers(1, usize::MAX)),
        &silent_all(["maxhullvert"], WHOLE),
        &silent_all(["smoothnormal"], YES),
    ]),
    silent("hfield", "asset", "content_type elevation file").typed(&[
        &[name("height field")],
        &silent_all(["ncol", "nrow"], WHOLE),
        &silent_all(["size"], FOUR),
    ]),
    silent("skin", "asset deformable", "face file group inflate material rgba texcoord vertex")
        .typed(&[&[name("skin")]]),
    silent("bone", "skin", "bindpos bindquat body vertid vertweight"),
    silent(
        "texture",
        "asset default",
        "content_type file fileback filedown filefront fileleft fileright fileup gridlayout",
    )
    .typed(&[
        &[
            name("texture"),
            class("class"),
            keyword("type", &["2d", "cube", "skybox"], "cube").without_effect(),
            keyword("builtin", &["none", "gradient", "checker", "flat"], "none").without_effect(),
            keyword("mark", &["none", "edge", "cross", "random"], "none").without_effect(),
            keyword("colorspace", &["auto", "linear", "sRGB"], "auto").without_effect(),
            keyword("embed", AUTO, "auto").without_effect(),
            attribute("gridsize", Kind::Integers(2, 2), "", "").without_effect(),
        ],
        &silent_all(["height", "nchannel", "width"], WHOLE),
        &silent_all(["markrgb", "rgb1", "rgb2"], THREE),
        &silent_all(["random"], NUMBER),
        &silent_all(["hflip", "vflip"], YES),
    ]),
    silent("material", "asset default", "").typed(&[
        &[
            name("material"),
            class("class"),
            reference("texture", "texture").in_default(),
            numbers("rgba", 4, "1 1 1 1", "1").lint(Lint::Colour).without_effect(),
        ],
        &silent_all(["emission", "metallic", "reflectance", "roughness", "shininess", "specular"], NUMBER),
        &silent_all(["texrepeat"], TWO),
        &silent_all(["texuniform"], YES),
    ]),
    silent("layer", "material", "role").typed(&[&[reference("texture", "texture").in_default()]]),
    silent("model", "asset", "content_type file name"),
    silent("plugin", "mesh", "*"),
    silent("config", "plugin", "key value"),
    // Default classes.
    element("default", "mujoco default", &[&[text("class")]]),
    // What Penny cannot use, but other actuators have something from.
    silent("orientation pid muscle adhesion dcmotor", "default", "*").typed(&[ACTUATOR, CTRLLIMITED]).once(),
    element("equality", "default", &[EQUALITY]),
    element("tendon", "default", &[TENDON, DRAWN, GROUP]),
    // Bodies.
    element("worldbody", "mujoco", &[]),
    element(
        "body",
        REAL_WORLD,
        &[
            &[name("body"), class("childclass"), POS],
            ORIENTATION,
            &[
                keyword("mocap", BOOL, "false"),
                number("gravcomp", "0", "1"),
                keyword("fuse", &["false", "auto"], "auto").without_effect(),
                keyword("simple", &["false", "auto"], "auto").without_effect(),
                keyword("sleep", &["auto", "never", "allowed", "init"], "auto").without_effect(),
                user(),
            ],
        ],
    ),
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
                keyword("scaling", &["similar", "geometry"], "similar").without_effect(),
            ],
        ],
    ),
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
    ),
    element(
        "joint",
        WITH_DEFAULT,
        &[
            &[
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
            ],
            GROUP,
        ],
    ),
    element("freejoint", REAL_WORLD, &[&[name("joint"), keyword("align", AUTO, "auto")], GROUP]),
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
                keyword("castshadow", BOOL, "true").without_effect(),
                // Of meshes.
                number("fitscale", "1", "1").without_effect(),
                user(),
            ],
        ],
    ),
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
                numbers("rgba", 4, "0.5 0.5 0.5 1", "1").lint(Lint::Colour).without_effect(),
                user(),
            ],
            GROUP,
        ],
    ),
    element(
        "camera",
        WITH_DEFAULT,
        &[
            &[
                name("camera"),
                class("class"),
                keyword("mode", TRACKING, "fixed"),
                reference("target", "body"),
                number("fovy", "45", "degrees").positive(),
                POS,
            ],
            ORIENTATION,
            &[
                keyword("projection", &["perspective", "orthographic"], "perspective").without_effect(),
                attribute("resolution", Kind::Integers(2, 2), "", "").without_effect(),
                user(),
            ],
            &silent_all(["focal", "focalpixel", "principal", "principalpixel", "sensorsize"], TWO),
            &silent_all(["ipd"], NUMBER),
        ],
    )
    .and("output"),
    silent("light", WITH_DEFAULT, "").typed(&[
        &[
            name("light"),
            class("class"),
            reference("target", "body"),
            reference("texture", "texture"),
            keyword("mode", TRACKING, "fixed").without_effect(),
            keyword("type", &["spot", "directional", "point", "image"], "spot").without_effect(),
        ],
        &silent_all(["ambient", "attenuation", "diffuse", "dir", "pos", "specular"], THREE),
        &silent_all(["bulbradius", "cutoff", "exponent", "intensity", "range", "softness"], NUMBER),
        &silent_all(["active", "castshadow", "directional"], YES),
    ]),
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
    element("motor", "actuator default", &[ACTUATOR, CTRLLIMITED]),
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
    ),
    element("velocity", "actuator default", &[ACTUATOR, CTRLLIMITED, &[number("kv", "1", "N s/m or N m s/rad")]]),
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
    ),
    element("damper", "actuator default", &[ACTUATOR, &[number("kv", "0", "N s/m or N m s/rad").not_negative()]]),
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
    ),
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
                numbers("velrange", 2, "", "").without_effect(),
                numbers("ffrange", 2, "", "").without_effect(),
                reference("body", "body").unsupported("the actuator would act on nothing", NO_TRANSMISSION),
            ],
        ],
    ),
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
    element("fixed", "tendon", &[&[name("tendon"), class("class")], TENDON, GROUP]),
    element("joint", "fixed", &[&[reference("joint", "joint").required(), number("coef", "", "1").required()]]),
    element("spatial", "tendon", &[&[name("tendon"), class("class")], TENDON, DRAWN, GROUP]),
    element("site", "spatial", &[&[reference("site", "site").required()]]),
    element("geom", "spatial", &[&[reference("geom", "geom").required(), reference("sidesite", "site")]]),
    element("pulley", "spatial", &[&[number("divisor", "", "1").positive().required()]]),
    unsupported("deformable", "mujoco", "the deformable bodies would be missing", "use rigid bodies"),
    unsupported("extension", "mujoco", "its plugins would be missing", "leave it out"),
    // Data.
    element("custom", "mujoco", &[]),
    element("numeric", "custom", &[&[name("numeric").required(), integer("size", "").positive(), list("data", "")]]),
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
            list("plastic", ""),
        ]],
    ),
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
    number("width", "0.003", "m").positive(),
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
const INTERPOLATION: Attribute = keyword("interp", &["zoh", "linear", "cubic"], "zoh").without_effect();
const SENSOR: &[Attribute] = &[
    name("sensor"),
    number("cutoff", "0", "").not_negative(),
    number("noise", "0", "").not_negative(),
    number("delay", "0", "s").ignored("the values come without delay"),
    up_to("interval", 2, "0 0", "s").ignored("the values come in every step"),
    integer("nsample", "0").without_effect(),
    INTERPOLATION,
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
    INTERPOLATION,
    integer("group", "0").without_effect(),
    number("cranklength", "0", "m"),
    user(),
];
