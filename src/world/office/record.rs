//! Data sets: pictures that the camera takes while the robot wanders by sonar, with labels from the geometry.

use std::fmt;
use std::str::FromStr;

use image::GrayImage;
use rayon::prelude::*;

use super::grabber::{Exposure, Grabber};
use super::people::Standing;
use super::wander::Wanderer;
use super::{BODY, FRAME_RATE, Kind, Moment, Office, OfficeError, Place, Plan, Setup};
use crate::camera::Camera;
use crate::dataset::{Case, Dataset, NamedImage};
use crate::world::Progress;
use crate::world::setup_error::check_frames;

/// Frames of the camera from one recorded picture to the next.
const EVERY: usize = 30;
/// Pictures of the sets that stand for the paper's.
const NSH: usize = 69;
const FMRB: usize = 71;
/// The drives recorded in the buildings drawn by hand: they turn two or three times, cross the stripe, meet people,
/// and pass through the dark.
const NSH_DRIVE: u64 = 4;
const FMRB_DRIVE: u64 = 7;

/// The changed building unless another is asked for. A changed building has the hallways and lights of the building of
/// its seed, so this is neither of those that choose the winner and are held out by default.
pub const CHANGED_BUILDING: u64 = 3;

impl Kind {
    /// Both kinds.
    pub const ALL: [Kind; 2] = [Kind::Nsh, Kind::Fmrb];

    /// Its name, as names of pictures begin.
    pub const fn name(self) -> &'static str {
        match self {
            Kind::Nsh => "nsh",
            Kind::Fmrb => "fmrb",
        }
    }

    fn frames(self) -> usize {
        match self {
            Kind::Nsh => NSH,
            Kind::Fmrb => FMRB,
        }
    }
}

/// Where and when a picture of a drive was taken.
#[derive(Debug, Clone)]
pub struct Shot {
    /// Seconds since the office's beginning.
    pub seconds: f64,
    /// Where the robot stood.
    pub place: Place,
    people: Vec<Standing>,
    exposure: Exposure,
}

impl Shot {
    /// The office it was taken in, as it was then.
    pub fn moment<'a>(&self, office: &'a Office) -> Moment<'a> {
        Moment { office, seconds: self.seconds, people: self.people.clone() }
    }
}

/// Lets a robot wander through an office by sonar until so many pictures are taken, one every 3 seconds. The seed
/// chooses how it drives; it starts at the first of the office's places.
///
/// # Errors
/// If a robot cannot stand there.
pub fn drive(office: &Office, frames: usize, seed: u64) -> Result<Vec<Shot>, OfficeError> {
    shots(office, frames, seed, &mut office.grabber(seed))
}

fn shots(office: &Office, frames: usize, seed: u64, grabber: &mut Grabber) -> Result<Vec<Shot>, OfficeError> {
    let taken = shots_and_before(office, frames, seed, grabber, 0, &Progress::default())?;
    Ok(taken.into_iter().filter_map(|mut shots| shots.pop()).collect())
}

/// For each picture the frames before it, so many as far as there are, and itself as the last.
fn shots_and_before(
    office: &Office,
    frames: usize,
    seed: u64,
    grabber: &mut Grabber,
    before: usize,
    progress: &Progress,
) -> Result<Vec<Vec<Shot>>, OfficeError> {
    let mut robot = Wanderer::new(office.free_start(0, BODY)?, seed);
    let mut crowd = office.crowd();
    let mut taken: Vec<Vec<Shot>> = Vec::new();
    let mut stretch = Vec::new();
    for k in 0..frames * EVERY {
        let seconds = k as f64 / FRAME_RATE;
        let place = *robot.place();
        crowd.advance(seconds, Some(&place));
        let moment = crowd.moment();
        let exposure = grabber.expose(&moment, &place);
        if EVERY - 1 - k % EVERY <= before {
            stretch.push(Shot { seconds, place, people: moment.people.clone(), exposure });
        }
        if k % EVERY == EVERY - 1 {
            taken.push(std::mem::take(&mut stretch));
            progress.step();
        }
        robot.step(&moment);
    }
    Ok(taken)
}

/// Records a drive (see [`drive`]): the pictures are named `NAME_0000.png` onward, and each of the set-up's columns has
/// its label.
///
/// # Errors
/// If no pictures are asked for, or more than 10,000, or a robot cannot stand where it starts.
pub fn record(office: &Office, name: &str, frames: usize, seed: u64) -> Result<Dataset, OfficeError> {
    record_told(office, name, frames, seed, &Progress::default())
}

/// The same; meanwhile one can see how far it is, a step for each picture taken and one for each developed.
///
/// # Errors
/// As [`record`].
pub fn record_told(
    office: &Office,
    name: &str,
    frames: usize,
    seed: u64,
    progress: &Progress,
) -> Result<Dataset, OfficeError> {
    progress.expect(frames.saturating_mul(2));
    Ok(record_with_earlier(office, name, frames, seed, 0, progress)?.0)
}

/// Where a picture of a recording was taken, and what the camera saw before.
#[derive(Debug, Clone, PartialEq)]
pub struct Earlier {
    /// Where the robot stood for the picture.
    pub place: Place,
    /// The frames before it, the latest last, and where the robot was.
    pub frames: Vec<(Place, GrayImage)>,
}

/// The same with up to so many frames before each picture, at most [`EVERY`] less one.
fn record_with_earlier(
    office: &Office,
    name: &str,
    frames: usize,
    seed: u64,
    before: usize,
    progress: &Progress,
) -> Result<(Dataset, Vec<Earlier>), OfficeError> {
    check_frames(frames)?;
    let mut grabber = office.grabber(seed);
    let taken = shots_and_before(office, frames, seed, &mut grabber, before, progress)?;
    let columns: Vec<u32> = office.setup().labelled().collect();
    let develop = |shot: &Shot| grabber.develop(&shot.moment(office), &shot.exposure);
    // what each picture depends on is known: the order in which they are made does not matter
    let made: Vec<(NamedImage, Vec<u32>, Earlier)> = taken
        .par_iter()
        .enumerate()
        .filter_map(|(i, shots)| {
            let (shot, before) = shots.split_last()?;
            let labels = shot.moment(office).labels(&shot.place, columns.iter().copied());
            let frames = before.iter().map(|shot| (shot.place, develop(shot))).collect();
            let image = NamedImage { name: format!("{name}_{i:04}.png"), pixels: develop(shot) };
            progress.step();
            Some((image, labels, Earlier { place: shot.place, frames }))
        })
        .collect();
    let (mut images, mut cases, mut earlier) = (Vec::new(), Vec::new(), Vec::new());
    for (image, (picture, labels, before)) in made.into_iter().enumerate() {
        images.push(picture);
        cases.extend(columns.iter().zip(labels).map(|(&x, y)| Case { image, x, y }));
        earlier.push(before);
    }
    let set =
        Dataset::new(name, images, cases).expect("pictures of one size with labels inside are a sound set");
    Ok((set, earlier))
}

/// A world to evolve detectors in: one of the three data sets of Martin (2006).
///
/// ```
/// use vsonar::world::office::World;
/// let world: World = "fmrb".parse()?;
/// assert_eq!(world.to_string(), "fmrb");
/// assert!("mars".parse::<World>().is_err());
/// # Ok::<(), vsonar::world::office::ParseWorldError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum World {
    /// Newell Simon Hall: people, and a wide stripe of other carpet.
    Nsh,
    /// The Field & Mobile Robotics Building: burned-out lights.
    Fmrb,
    /// Every other picture of both.
    Combined,
}

/// A name that no world has.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("there is no world of this name; choose nsh, fmrb or combined")]
pub struct ParseWorldError;

impl FromStr for World {
    type Err = ParseWorldError;

    fn from_str(text: &str) -> Result<World, ParseWorldError> {
        match text {
            "nsh" => Ok(World::Nsh),
            "fmrb" => Ok(World::Fmrb),
            "combined" => Ok(World::Combined),
            _ => Err(ParseWorldError),
        }
    }
}

impl fmt::Display for World {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            World::Nsh => "nsh",
            World::Fmrb => "fmrb",
            World::Combined => "combined",
        })
    }
}

/// Which of a world's sets.
#[derive(Clone, Copy)]
enum Which {
    Training,
    Elsewhere(u64),
    Changed(u64),
}

impl Which {
    fn new(building: Option<u64>, changed: bool) -> Which {
        match (building, changed) {
            (None, false) => Which::Training,
            (Some(seed), false) => Which::Elsewhere(seed),
            (seed, true) => Which::Changed(seed.unwrap_or(CHANGED_BUILDING)),
        }
    }
}

impl World {
    /// The set to train on: 69 pictures of `nsh`, 71 of `fmrb`, 70 of both for `combined`; six columns in each.
    pub fn training(self) -> Dataset {
        self.set(Which::Training, None).expect("the presets are in range")
    }

    /// The same camera and things in another building of the kind, by seed.
    pub fn elsewhere(self, seed: u64) -> Dataset {
        self.set(Which::Elsewhere(seed), None).expect("generated buildings are in range")
    }

    /// The building of this seed with things that no building trained on holds, seen by a camera of another pitch, height
    /// and exposure. Its hallways and lights are those of [`World::elsewhere`].
    pub fn changed(self, seed: u64) -> Dataset {
        self.set(Which::Changed(seed), None).expect("generated buildings are in range")
    }

    /// The training set, another building's or, with `changed`, a changed one's, of so many pictures (of each of both
    /// buildings for `combined`, of which every other one is taken).
    ///
    /// # Errors
    /// If no pictures are asked for, or more than 10,000.
    pub fn recorded(
        self,
        building: Option<u64>,
        changed: bool,
        frames: Option<usize>,
    ) -> Result<Dataset, OfficeError> {
        self.recorded_told(building, changed, frames, &Progress::default())
    }

    /// The same; meanwhile one can see how far it is, as by [`record_told`].
    ///
    /// # Errors
    /// As [`World::recorded`].
    pub fn recorded_told(
        self,
        building: Option<u64>,
        changed: bool,
        frames: Option<usize>,
        progress: &Progress,
    ) -> Result<Dataset, OfficeError> {
        Ok(self.set_with_earlier(Which::new(building, changed), frames, 0, progress)?.0)
    }

    /// The same, and for each picture up to so many of the frames that the camera saw before it (at most 29, for there is
    /// a picture every 30 frames), as one needs who compares frames.
    ///
    /// # Errors
    /// As [`World::recorded`].
    pub fn recorded_with_earlier(
        self,
        building: Option<u64>,
        changed: bool,
        frames: Option<usize>,
        before: usize,
    ) -> Result<(Dataset, Vec<Earlier>), OfficeError> {
        self.set_with_earlier(Which::new(building, changed), frames, before, &Progress::default())
    }

    fn set(self, which: Which, frames: Option<usize>) -> Result<Dataset, OfficeError> {
        Ok(self.set_with_earlier(which, frames, 0, &Progress::default())?.0)
    }

    fn set_with_earlier(
        self,
        which: Which,
        frames: Option<usize>,
        before: usize,
        progress: &Progress,
    ) -> Result<(Dataset, Vec<Earlier>), OfficeError> {
        let kinds: &[Kind] = match self {
            World::Nsh => &[Kind::Nsh],
            World::Fmrb => &[Kind::Fmrb],
            World::Combined => &Kind::ALL,
        };
        kinds.iter().for_each(|kind| progress.expect(frames.unwrap_or(kind.frames()).saturating_mul(2)));
        let drive = |kind: Kind| {
            let frames = frames.unwrap_or(kind.frames());
            let own = match kind {
                Kind::Nsh => NSH_DRIVE,
                Kind::Fmrb => FMRB_DRIVE,
            };
            let (plan, setup, seed) = match which {
                Which::Training => (kind.plan(), Setup::default(), own),
                Which::Elsewhere(seed) => (Plan::generate(kind, seed, false), Setup::default(), seed),
                Which::Changed(seed) => {
                    (Plan::generate(kind, seed, true), Setup::default().varied(seed), seed)
                }
            };
            let building = if matches!(which, Which::Training) { 0 } else { seed };
            let office = Office::build(&plan, &setup, building)?;
            record_with_earlier(&office, kind.name(), frames, seed, before, progress)
        };
        match self {
            World::Nsh => drive(Kind::Nsh),
            World::Fmrb => drive(Kind::Fmrb),
            World::Combined => Ok(every_other(drive(Kind::Nsh)?, drive(Kind::Fmrb)?)),
        }
    }

    /// The camera that takes the pictures, but for those of changed buildings.
    pub fn camera(self) -> Camera {
        Setup::default().camera
    }
}

/// A set, and of each picture what was before it.
type Recording = (Dataset, Vec<Earlier>);

/// Every other picture of two sets, those of the first before those of the second.
fn every_other(first: Recording, second: Recording) -> Recording {
    let (mut images, mut cases, mut kept) = (Vec::new(), Vec::new(), Vec::new());
    // 35 of 69 and 35 of 71: the odd ones of the second, the even ones of the first
    for ((set, earlier), from) in [(first, 0), (second, 1)] {
        for (i, (image, earlier)) in set.images().iter().zip(earlier).enumerate().skip(from).step_by(2) {
            let of_image = set.cases().iter().filter(|case| case.image == i);
            cases.extend(of_image.map(|case| Case { image: images.len(), ..*case }));
            images.push(image.clone());
            kept.push(earlier);
        }
    }
    (Dataset::new("combined", images, cases).expect("two sound sets of one size are one"), kept)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_frame_of_a_recorded_drive_touches_anything_or_anybody() {
        let small = Setup { width: 16, height: 16, columns: 1, ..Setup::default() };
        let mut met = f64::INFINITY;
        for (kind, seed) in [(Kind::Nsh, NSH_DRIVE), (Kind::Fmrb, FMRB_DRIVE), (Kind::Nsh, 1), (Kind::Nsh, 2)]
        {
            let preset = [NSH_DRIVE, FMRB_DRIVE].contains(&seed);
            let plan = if preset { kind.plan() } else { Plan::generate(kind, seed, seed == 2) };
            let office = Office::build(&plan, &small, if preset { 0 } else { seed }).expect("sound");
            let (mut robot, mut crowd) = (Wanderer::new(office.start(0), seed), office.crowd());
            for k in 0..kind.frames() * EVERY {
                let place = *robot.place();
                crowd.advance(k as f64 / FRAME_RATE, Some(&place));
                let moment = crowd.moment();
                let clear = moment.nearest(place.x, place.y, 9.0);
                assert!(clear.distance > BODY, "{kind:?} {seed}, frame {k}: {clear:?}");
                let away = |&(x, y, radius): &(f64, f64, f64)| libm::hypot(x - place.x, y - place.y) - radius;
                met = moment.people().iter().map(away).fold(met, f64::min);
                robot.step(&moment);
            }
        }
        assert!(met < 1.0, "they meet: {met}");
    }
}
