//! Pictures and the files they go into.

use std::path::{Path, PathBuf};

use penny::math::Vec3;
use penny_view::camera::Camera;
use penny_view::film::Film;
use penny_view::log::Change;
use penny_view::paint::{Image, Painter, paint};
use penny_view::scene::{self, NORMAL_FORCE};
use penny_view::session::Session;
use penny_view::video::{Format, Shape, Video};

use crate::view::{session, written};

const SIZE: [usize; 2] = [320, 240];

const SHAPES: &str = r#"<mujoco><worldbody><geom type="plane" size="1 1 1"/>
    <body pos="-0.6 0.1 0.2"><freejoint/><geom type="sphere" size="0.2" rgba="1 1 1 1"/></body>
    <body pos="0 -0.4 0.15"><freejoint/><geom type="box" size="0.2 0.15 0.15" euler="0 0 25"/></body>
    <body pos="0.5 0.2 0.2"><freejoint/><geom type="cylinder" size="0.12 0.2"/></body>
    <body pos="-0.1 0.5 0.1"><freejoint/><geom type="capsule" size="0.1 0.2" euler="0 90 30"/></body>
    <body pos="0.55 -0.5 0.1"><freejoint/><geom type="ellipsoid" size="0.25 0.15 0.1"/></body>
    <body pos="-0.55 -0.5 0.2"><freejoint/><geom type="cylinder" size="0.2 0.01" euler="90 0 0" rgba="0.2 0.4 0.8 0.5"/></body>
    </worldbody></mujoco>"#;
const SLOPE: &str = r#"<mujoco><worldbody><geom type="plane" size="1 1 1" euler="0 15 0"/>
    <body pos="0 0 0.6" euler="20 15 40"><freejoint/><geom type="box" size="0.2 0.2 0.05"/>
    <geom type="box" size="0.05 0.2 0.2" pos="0 0 -0.25"/></body></worldbody></mujoco>"#;

/// The five scenes of the golden pictures.
fn golden() -> Vec<(&'static str, Session, usize)> {
    vec![
        ("shapes", written(SHAPES), 0),
        ("slope", written(SLOPE), 20),
        ("goal", session("models/goal.xml"), 10),
        ("keeper", session("models/goal_keeper.xml"), 30),
        ("circle", session("models/goal_2d.xml"), 10),
    ]
}

fn picture(session: &mut Session, frame: usize, threads: usize) -> Image {
    let camera = scene::first_look(session);
    let mut film = Film::new(session, camera, None, 50.0, 1.0);
    let list = film.frame(frame, session, None).expect("no divergence");
    paint(&list, SIZE[0], SIZE[1], threads)
}

fn read(path: &Path) -> Image {
    let decoder = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(path).expect("committed")));
    let mut reader = decoder.read_info().expect("a PNG");
    let mut rgb = vec![0; reader.output_buffer_size().expect("small")];
    let info = reader.next_frame(&mut rgb).expect("a picture");
    let rgba = rgb[..info.buffer_size()].chunks_exact(3).flat_map(|p| [p[0], p[1], p[2], 255]).collect();
    Image { width: info.width as usize, height: info.height as usize, rgba }
}

fn folder() -> PathBuf {
    Path::new(crate::ROOT).join("tests/pictures")
}

/// Pixel by pixel. The arithmetic is f32 without fused operations, so the same machine gives the same bytes; another
/// compiler may round an edge's coverage the other way, which moves single pixels by up to a quarter of a contrast
/// (64 levels), never many of them. `PENNY_BLESS=1 cargo test --test it picture` writes new ones to look at.
#[test]
fn five_scenes_look_as_they_did() {
    for (name, mut session, frame) in golden() {
        let image = picture(&mut session, frame, 2);
        let path = folder().join(format!("{name}.png"));
        if std::env::var_os("PENNY_BLESS").is_some() {
            save(&path, &[&image]).expect("writable");
        }
        let expected = read(&path);
        assert_eq!([expected.width, expected.height], SIZE);
        let off: Vec<u8> = image.rgba.iter().zip(&expected.rgba).map(|(a, b)| a.abs_diff(*b)).collect();
        let mean = off.iter().map(|&d| f64::from(d)).sum::<f64>() / off.len() as f64;
        let bad = off.chunks(4).filter(|p| p.iter().any(|&d| d > 6)).count();
        assert!(mean < 0.02 && bad <= 80, "{name}: {bad} pixels differ, mean {mean}");
        assert!(off.iter().all(|&d| d <= 96), "{name}: a pixel is quite another");
    }
}

#[test]
fn threads_change_nothing_but_the_time() {
    let mut one = written(SHAPES);
    let mut many = written(SHAPES);
    assert_eq!(picture(&mut one, 10, 1), picture(&mut many, 10, 3));
}

/// The painter keeps sky and floors from one picture to the next, as long as they stay the same.
#[test]
fn what_the_painter_keeps_changes_nothing() {
    let mut session = session("models/goal.xml");
    let mut film = Film::new(&session, scene::first_look(&session), None, 50.0, 1.0);
    let mut painter = Painter::new(1);
    let mut image = Image::new(SIZE[0], SIZE[1]);
    for frame in 0..6 {
        if frame == 3 {
            film.camera.orbit(0.3, 0.1);
        }
        let list = film.frame(4 * frame, &mut session, None).expect("no divergence");
        painter.paint(&list, &mut image);
        assert_eq!(image, paint(&list, SIZE[0], SIZE[1], 1), "picture {frame}");
    }
}

#[test]
fn where_two_floors_meet_the_nearer_one_is_seen() {
    let session = written(
        r#"<mujoco><worldbody><geom type="plane" size="1 1 1" euler="0 20 0" rgba="0.8 0.2 0.2 1"/>
        <geom type="plane" size="1 1 1" euler="0 -20 0" rgba="0.2 0.2 0.8 1"/></worldbody></mujoco>"#,
    );
    let camera = Camera { azimuth: 90f64.to_radians(), elevation: -30f64.to_radians(), ..Camera::default() };
    let list = scene::draw(&session.model, &session.poses(1.0), camera);
    let image = paint(&list, SIZE[0], SIZE[1], 1);
    // A valley along y: the plane that falls to the right is the higher one on the left.
    let (left, right) = (image.pixel(SIZE[0] / 4, SIZE[1] / 2), image.pixel(3 * SIZE[0] / 4, SIZE[1] / 2));
    assert!(left[0] > 2 * left[2] && right[2] > 2 * right[0], "left {left:?}, right {right:?}");
}

#[test]
fn a_body_is_where_the_camera_says_and_has_its_colour() {
    let mut session = written(
        r#"<mujoco><worldbody><body pos="0.3 0 0.4"><freejoint/><geom type="sphere" size="0.1" rgba="0.8 0.1 0.1 1"/></body>
        </worldbody></mujoco>"#,
    );
    let camera = Camera { target: Vec3::new(0.0, 0.0, 0.4), distance: 2.0, ..Camera::default() };
    let list = scene::draw(&session.model, &session.poses(1.0), camera);
    let image = paint(&list, SIZE[0], SIZE[1], 1);
    let [x, y, _] = camera.project(&session.data.xpos[1], [320.0, 240.0]).expect("in front");
    let red = |p: [u8; 3]| p[0] / 2 > p[1] && p[0] / 2 > p[2];
    assert!(red(image.pixel(x as usize, y as usize)));
    // The sphere's outline: its angular radius is asin(r / d).
    let d = (session.data.xpos[1] - camera.axes().eye).norm();
    let radius = (0.1 / d).asin().tan() * 120.0 / (0.5 * camera.fovy).tan();
    let reds = image.rgba.chunks(4).filter(|p| red([p[0], p[1], p[2]])).count() as f64;
    let area = std::f64::consts::PI * radius * radius;
    // Off-centre a sphere's picture is an ellipse, a few percent larger.
    assert!((reds / area - 1.0).abs() < 0.06, "{reds} red pixels, expected {area}");
    session.step().expect("falls");
}

#[test]
fn turning_a_body_changes_its_picture() {
    let mut session = session("models/goal.xml");
    let before = picture(&mut session, 0, 1);
    let mut start = penny_view::log::Start::of(&session.state);
    start.qpos[3..7].copy_from_slice(&[0.8, 0.6, 0.0, 0.0]);
    session.change(Change::State(start)).expect("fits");
    assert_ne!(picture(&mut session, 0, 1), before, "a ball without a pattern would look the same");
}

#[test]
fn a_resting_body_shows_its_normal_force() {
    let mut session = written(SHAPES);
    (0..300).for_each(|_| session.step().expect("stable"));
    let with = picture(&mut session, 0, 1);
    let blue = |p: &[u8]| p[2] > 150 && p[2] > p[0].saturating_add(80) && p[2] > p[1].saturating_add(40);
    let blues = with.rgba.chunks(4).filter(|p| blue(p)).count();
    assert!(blues > 30, "{blues} pixels of the colour {NORMAL_FORCE:?}");
}

fn save(path: &Path, images: &[&Image]) -> Result<(), String> {
    let shape = Shape { width: images[0].width, height: images[0].height, fps: 40.0, frames: images.len() };
    let mut video = Video::create(path, shape)?;
    images.iter().try_for_each(|image| video.push(image))?;
    video.finish()
}

/// A file in a folder of this test process's own.
fn temporary(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("penny-video-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("writable");
    folder.join(name)
}

#[test]
fn a_gif_holds_the_frames_that_were_put_in() {
    let mut session = session("models/goal.xml");
    let images: Vec<Image> = (0..5)
        .map(|_| {
            (0..40).for_each(|_| session.step().expect("stable"));
            picture(&mut session, 0, 1)
        })
        .collect();
    let path = temporary("a.gif");
    save(&path, &images.iter().collect::<Vec<_>>()).expect("writable");
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(std::fs::File::open(&path).expect("written")).expect("a GIF");
    let (mut shown, mut delays, mut n) = (vec![0u8; SIZE[0] * SIZE[1] * 4], 0, 0);
    while let Some(frame) = decoder.read_next_frame().expect("a frame") {
        for (i, p) in frame.buffer.chunks(4).enumerate().filter(|(_, p)| p[3] > 0) {
            let (x, y) =
                (i % frame.width as usize + frame.left as usize, i / frame.width as usize + frame.top as usize);
            let at = 4 * (y * SIZE[0] + x);
            shown[at..at + 4].copy_from_slice(p);
        }
        let worst = shown.iter().zip(&images[n].rgba).map(|(a, b)| f64::from(a.abs_diff(*b))).sum::<f64>();
        // 255 colours: a few levels off on average.
        assert!(worst / (shown.len() as f64) < 2.5, "frame {n}: {}", worst / shown.len() as f64);
        delays += u32::from(frame.delay);
        n += 1;
    }
    // 5 frames at 40 a second are 12.5 hundredths: 2 and 3 in turn.
    assert_eq!((n, delays), (5, 13));
}

#[test]
fn png_and_apng_hold_the_very_pixels() {
    let mut session = written(SHAPES);
    let images = [picture(&mut session, 0, 1), picture(&mut session, 15, 1)];
    let still = temporary("a.png");
    save(&still, &[&images[0], &images[1]]).expect("writable");
    assert_eq!(read(&still), images[1], "a PNG is the last picture");
    let moving = temporary("a.apng");
    save(&moving, &[&images[0], &images[1]]).expect("writable");
    assert_eq!(read(&moving), images[0], "an APNG opens with the first");
    let decoder = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(&moving).expect("written")));
    assert_eq!(decoder.read_info().expect("a PNG").info().animation_control.map(|a| a.num_frames), Some(2));
}

#[test]
fn what_cannot_be_written_is_said_in_one_sentence() {
    assert!(Format::of(Path::new("a.avi")).is_err_and(|e| e.contains(".gif") && e.contains(".mp4")));
    let shape = Shape { width: 32, height: 32, fps: 60.0, frames: 1 };
    assert!(Video::create(Path::new("a.gif"), shape).is_err_and(|e| e.contains("at most 50")));
    let nowhere = Path::new("/no/such/folder/a.gif");
    assert!(Video::create(nowhere, Shape { fps: 50.0, ..shape }).is_err_and(|e| e.contains("/no/such/folder")));
}
