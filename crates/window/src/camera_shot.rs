//! Filming the window's picture: written on a thread of its own, at a steady frame rate.

use std::path::PathBuf;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::JoinHandle;

use super::free_name;
use penny_view::draw::DrawList;
use penny_view::paint::{Image, paint};
use penny_view::video::{self, Shape, Video};

pub struct Shooting {
    pub path: PathBuf,
    /// Pictures, and how many frames each is shown.
    sender: SyncSender<(Image, usize)>,
    thread: JoinHandle<Result<usize, String>>,
    size: [usize; 2],
    fps: f64,
    /// Frames not yet filmed.
    due: f64,
}

/// Pictures that may wait for the writer before the window has to.
const WAITING: usize = 16;

impl Shooting {
    /// Begins a file with a new name: MP4 where that can be written, else GIF.
    pub fn start([width, height]: [usize; 2]) -> Result<Shooting, String> {
        let ending = if video::has_mp4() { "mp4" } else { "gif" };
        let path = free_name("penny", ending);
        let fps = video::Format::of(&path)?.usual_fps();
        let mut video = Video::create(&path, Shape { width, height, fps, frames: 0 })?;
        let (sender, pictures) = sync_channel::<(Image, usize)>(WAITING);
        let thread = std::thread::spawn(move || {
            let mut frames = 0;
            for (image, times) in pictures {
                (0..times).try_for_each(|_| video.push(&image))?;
                frames += times;
            }
            video.finish().map(|()| frames)
        });
        Ok(Shooting { path, sender, thread, size: [width, height], fps, due: 0.0 })
    }

    /// Films the picture shown for as many frames as the wall time since the last one asks for.
    pub fn offer(&mut self, list: &DrawList, shown: &Image, elapsed: f64) {
        self.due += elapsed.min(0.25) * self.fps;
        let times = self.due.floor();
        self.due -= times;
        if times < 1.0 {
            return;
        }
        let [width, height] = self.size;
        // The window may have become larger or smaller; the film cannot.
        let same = [shown.width, shown.height] == self.size;
        let image = if same { shown.clone() } else { paint(list, width, height, 1) };
        // A writer that has stopped says why when it is finished.
        let _ = self.sender.send((image, times as usize));
    }

    /// Ends the file and says what became of it.
    pub fn finish(self) -> String {
        drop(self.sender);
        match self.thread.join() {
            Ok(Ok(frames)) => format!("{}: {:.1} s filmed", self.path.display(), frames as f64 / self.fps),
            Ok(Err(problem)) => problem,
            Err(_) => format!("filming into {} failed", self.path.display()),
        }
    }
}
