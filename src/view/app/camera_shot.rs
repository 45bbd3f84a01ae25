//! Filming the window's picture: drawn again and written on a thread of its own, at a steady frame rate.

use std::path::PathBuf;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::JoinHandle;

use super::free_name;
use crate::view::draw::DrawList;
use crate::view::paint::paint;
use crate::view::video::{self, Shape, Video};

pub struct Shooting {
    pub path: PathBuf,
    sender: SyncSender<DrawList>,
    thread: JoinHandle<Result<usize, String>>,
    fps: f64,
    /// Wall time not yet filmed, s.
    due: f64,
}

/// Pictures that may wait for the writer before the window has to.
const WAITING: usize = 16;

impl Shooting {
    /// Begins a file with a new name: MP4 where ffmpeg is installed, else GIF.
    pub fn start([width, height]: [usize; 2]) -> Result<Shooting, String> {
        let ending = if video::has_ffmpeg() { "mp4" } else { "gif" };
        let path = free_name(ending);
        let fps = video::Format::of(&path)?.usual_fps();
        let mut video = Video::create(&path, Shape { width, height, fps, frames: 0 })?;
        let (sender, lists) = sync_channel::<DrawList>(WAITING);
        let thread = std::thread::spawn(move || {
            let mut frames = 0;
            for list in lists {
                video.push(&paint(&list, width, height, 1))?;
                frames += 1;
            }
            video.finish().map(|()| frames)
        });
        Ok(Shooting { path, sender, thread, fps, due: 0.0 })
    }

    /// Films a picture as often as the wall time since the last one asks for.
    pub fn offer(&mut self, list: &DrawList, elapsed: f64) {
        self.due += elapsed.min(0.25);
        while self.due >= 1.0 / self.fps {
            self.due -= 1.0 / self.fps;
            // A writer that has stopped says why when it is finished.
            let _ = self.sender.send(list.clone());
        }
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
