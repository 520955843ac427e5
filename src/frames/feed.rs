//! A source that is read by a thread of its own, so that whoever waits for a frame can be called away, and so that a
//! slow reader of a camera can take the newest frame instead of the next one.

use std::io;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use super::{Frame, FrameError, FrameFault, FrameSource};

/// Which frame comes next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pace {
    /// Every frame, each read when it is asked for: what writes the stream waits.
    Every,
    /// The newest frame: the source is read as fast as it delivers, and what nobody asked for in time is dropped.
    Newest,
}

/// What [`Feed::next`] brings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Next {
    /// A frame.
    Frame,
    /// The source has no more.
    End,
    /// The caller was to be called away.
    Stopped,
}

/// A source with its thread, which ends with the source, or once it notices that the feed has been dropped.
#[derive(Debug)]
pub struct Feed {
    shared: Arc<Shared>,
}

#[derive(Debug, Default)]
struct Shared {
    slot: Mutex<Slot>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct Slot {
    frame: Frame,
    /// Whether `frame` has been read and not taken yet.
    full: bool,
    wanted: bool,
    dropped: u64,
    /// How the source ended.
    end: Option<Result<(), FrameError>>,
    /// Whether nobody will ask any more.
    closed: bool,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Slot> {
        self.slot.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// How often a waiting caller looks whether it is to be called away.
const TICK: Duration = Duration::from_millis(20);

impl Feed {
    /// Begins to read.
    ///
    /// # Errors
    /// If there can be no further thread.
    pub fn start(source: impl FrameSource + 'static, pace: Pace) -> io::Result<Feed> {
        let shared = Arc::new(Shared::default());
        let (feed, thread) = (Feed { shared: shared.clone() }, std::thread::Builder::new());
        thread.name("frames".into()).spawn(move || deliver(source, pace, &shared))?;
        Ok(feed)
    }

    /// Brings the next frame, in exchange for one whose memory is used again, or waits for it as long as `stop` does
    /// not hold. Frames that have been read are handed out before the end or an error.
    ///
    /// # Errors
    /// As the source has it.
    pub fn next(&mut self, frame: &mut Frame, stop: impl Fn() -> bool) -> Result<Next, FrameError> {
        let mut slot = self.shared.lock();
        slot.wanted = true;
        self.shared.changed.notify_all();
        loop {
            if stop() {
                return Ok(Next::Stopped);
            }
            if slot.full {
                std::mem::swap(&mut slot.frame, frame);
                slot.full = false;
                return Ok(Next::Frame);
            }
            match slot.end.take() {
                Some(Ok(())) => {
                    slot.end = Some(Ok(()));
                    return Ok(Next::End);
                }
                Some(Err(error)) => {
                    slot.end = Some(Ok(()));
                    return Err(error);
                }
                None => {}
            }
            slot = self.shared.changed.wait_timeout(slot, TICK).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// How many frames were read and never asked for.
    pub fn dropped(&self) -> u64 {
        self.shared.lock().dropped
    }
}

impl Drop for Feed {
    fn drop(&mut self) {
        self.shared.lock().closed = true;
        self.shared.changed.notify_all();
    }
}

/// Tells the end of a thread that panics, for whom one would wait for ever.
struct Last<'a>(&'a Shared);

impl Drop for Last<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            let fault = FrameFault::Read(io::Error::other("the reader failed"));
            let error = FrameError { origin: "the input".to_string(), frame: None, fault };
            self.0.lock().end = Some(Err(error));
            self.0.changed.notify_all();
        }
    }
}

fn deliver(mut source: impl FrameSource, pace: Pace, shared: &Shared) {
    let _last = Last(shared);
    let mut frame = Frame::default();
    loop {
        let mut slot = shared.lock();
        while pace == Pace::Every && !slot.wanted && !slot.closed {
            slot = shared.changed.wait(slot).unwrap_or_else(PoisonError::into_inner);
        }
        if slot.closed {
            return;
        }
        slot.wanted = false;
        drop(slot);
        let read = source.read(&mut frame);
        let mut slot = shared.lock();
        match read {
            Ok(true) => {
                std::mem::swap(&mut slot.frame, &mut frame);
                slot.dropped += u64::from(slot.full);
                slot.full = true;
            }
            end => slot.end = Some(end.map(|_| ())),
        }
        let ended = slot.end.is_some();
        drop(slot);
        shared.changed.notify_all();
        if ended {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::{Receiver, Sender, channel};

    /// Delivers a frame for every token it is sent, and an error at the end if it is told so.
    struct Tokens {
        tokens: Receiver<bool>,
        next: u64,
    }

    fn tokens() -> (Sender<bool>, Tokens) {
        let (sender, tokens) = channel();
        (sender, Tokens { tokens, next: 0 })
    }

    impl FrameSource for Tokens {
        fn width(&self) -> u32 {
            16
        }

        fn height(&self) -> u32 {
            16
        }

        fn read(&mut self, frame: &mut Frame) -> Result<bool, FrameError> {
            match self.tokens.recv() {
                Ok(true) => {
                    frame.index = self.next;
                    self.next += 1;
                    Ok(true)
                }
                Ok(false) => {
                    let fault = FrameFault::Truncated { got: 1, expected: 2 };
                    Err(FrameError { origin: "x".into(), frame: Some(self.next), fault })
                }
                Err(_) => Ok(false),
            }
        }
    }

    #[test]
    fn every_frame_comes_once_and_then_the_end() {
        let (sender, source) = tokens();
        (0..5).for_each(|_| sender.send(true).expect("heard"));
        drop(sender);
        let mut feed = Feed::start(source, Pace::Every).expect("a thread");
        let mut frame = Frame::default();
        for i in 0..5 {
            assert_eq!(feed.next(&mut frame, || false).expect("sound"), Next::Frame);
            assert_eq!(frame.index, i);
        }
        for _ in 0..2 {
            assert_eq!(feed.next(&mut frame, || false).expect("sound"), Next::End);
        }
        assert_eq!(feed.dropped(), 0);
    }

    #[test]
    fn the_newest_frame_replaces_those_before_it() {
        let (sender, source) = tokens();
        let mut feed = Feed::start(source, Pace::Newest).expect("a thread");
        (0..5).for_each(|_| sender.send(true).expect("heard"));
        sender.send(false).expect("heard");
        while feed.shared.lock().end.is_none() {
            std::thread::yield_now();
        }
        let mut frame = Frame::default();
        assert_eq!(feed.next(&mut frame, || false).expect("the frame before the error"), Next::Frame);
        assert_eq!((frame.index, feed.dropped()), (4, 4));
        feed.next(&mut frame, || false).expect_err("the error");
        assert_eq!(feed.next(&mut frame, || false).expect("told already"), Next::End);
    }

    #[test]
    fn who_waits_can_be_called_away() {
        let (sender, source) = tokens();
        let mut feed = Feed::start(source, Pace::Every).expect("a thread");
        let asked = std::cell::Cell::new(0);
        let stop = || {
            asked.set(asked.get() + 1);
            asked.get() > 2
        };
        assert_eq!(feed.next(&mut Frame::default(), stop).expect("nothing is wrong"), Next::Stopped);
        drop(sender);
    }

    /// A source with a fault of its own.
    struct Faulty;

    impl FrameSource for Faulty {
        fn width(&self) -> u32 {
            16
        }

        fn height(&self) -> u32 {
            16
        }

        fn read(&mut self, _: &mut Frame) -> Result<bool, FrameError> {
            panic!("on purpose")
        }
    }

    #[test]
    fn nobody_waits_for_a_thread_that_panicked() {
        let mut feed = Feed::start(Faulty, Pace::Every).expect("a thread");
        feed.next(&mut Frame::default(), || false).expect_err("the reader failed");
    }

    #[test]
    fn nothing_is_read_before_it_is_asked_for() {
        let (sender, source) = tokens();
        (0..2).for_each(|_| sender.send(true).expect("heard"));
        let mut feed = Feed::start(source, Pace::Every).expect("a thread");
        let mut frame = Frame::default();
        assert_eq!(feed.next(&mut frame, || false).expect("sound"), Next::Frame);
        std::thread::sleep(Duration::from_millis(30));
        assert!(!feed.shared.lock().full);
        drop(feed);
        // The thread ends, and with it the receiver.
        while sender.send(true).is_ok() {
            std::thread::yield_now();
        }
    }
}
