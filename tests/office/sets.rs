//! The data sets: what the paper tells of its own holds for them too.

use vsonar::dataset::{Constants, Dataset, TOLERANCE};
use vsonar::world::SetupError;
use vsonar::world::office::{CHANGED_BUILDING, Kind, Office, Plan, Setup, World, drive, record};

fn small() -> Setup {
    Setup { width: 64, height: 48, ..Setup::default() }
}

fn recorded(kind: Kind, seed: u64) -> Dataset {
    let office = Office::build(&kind.plan(), &small(), 0).unwrap();
    record(&office, "small", 5, seed).unwrap()
}

/// Of five small pictures of each building. A change of them is a change of every set that was ever recorded: say so
/// in the change log.
const PINNED: [(Kind, u64); 2] = [(Kind::Nsh, 0x2d5c_fe67_62fb_8bf7), (Kind::Fmrb, 0x8a5f_92b9_1b2f_3343)];

#[test]
fn a_seed_is_a_set() {
    for (kind, pinned) in PINNED {
        let set = recorded(kind, 1);
        assert_eq!(
            set.fingerprint(),
            pinned,
            "{kind:?}: pictures or labels changed: {:#018x}",
            set.fingerprint()
        );
        let threads = |n| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
            pool.install(|| recorded(kind, 1))
        };
        assert_eq!(threads(1), set);
        assert_eq!(threads(2), set);
        assert_ne!(recorded(kind, 2).fingerprint(), set.fingerprint());
    }
}

#[test]
fn the_training_sets_are_like_the_papers() {
    let sets = [World::Nsh, World::Fmrb, World::Combined].map(|world| (world, world.training()));
    for (world, set) in &sets {
        assert_eq!(set.name(), world.to_string());
        assert_eq!((set.width(), set.height()), (320, 240));
        assert_eq!(set.columns(), [27, 80, 133, 187, 240, 293]);
        assert!((65..=71).contains(&set.images().len()) && (390..=426).contains(&set.cases().len()));
        let constants = Constants::learn(set, TOLERANCE);
        let score = constants.score(set);
        let (overall, per_column) = (score.overall_share(), score.per_column_share());
        // the best of a first generation had 21.6 to 36.4 %: about what the best constant gets
        assert!(overall > 0.2 && overall < 0.364, "{world}: {overall}");
        assert!(per_column < 0.4, "{world}: {per_column}");
        assert!(constants.columns().iter().all(|(_, best)| best.share() < 0.5), "{world}: {constants:?}");
        let share = |of: &dyn Fn(u32) -> bool| {
            set.labels().into_iter().filter(|&y| of(y)).count() as f64 / set.cases().len() as f64
        };
        assert!((0.02..0.15).contains(&share(&|y| y == 239)), "{world}: obstacles down to the bottom row");
        assert!((0.05..0.25).contains(&share(&|y| y == 0)), "{world}: free columns");
        assert!(set.images().windows(2).all(|pair| pair[0].pixels != pair[1].pixels));
        let dark = set.images().iter().flat_map(|image| image.pixels.as_raw()).all(|&v| v == 16 || v >= 32);
        assert!(dark, "{world}: the digitizer turns what is below 32 into 16");
    }
    let [(_, nsh), (_, fmrb), (_, combined)] = &sets;
    let halves = nsh.images().iter().step_by(2).chain(fmrb.images().iter().skip(1).step_by(2));
    assert!(combined.images().iter().eq(halves), "every other picture of both");
    for case in combined.cases() {
        let name = &combined.images()[case.image].name;
        let of = if name.starts_with("nsh") { nsh } else { fmrb };
        let same = |c: &&vsonar::dataset::Case| of.images()[c.image].name == *name && c.x == case.x;
        assert_eq!(of.cases().iter().find(same).map(|c| c.y), Some(case.y));
    }
}

/// Mean gray value of the carpet in each picture of a drive that shows enough of it.
fn carpets(kind: Kind, seed: u64) -> Vec<f64> {
    let office = Office::preset(kind);
    let set = record(&office, "carpet", 71, seed).unwrap();
    let shots = drive(&office, 71, seed).unwrap();
    let of = |(image, shot): (&vsonar::dataset::NamedImage, &vsonar::world::office::Shot)| {
        let floor = shot.moment(&office).floor(&shot.place);
        let pixels = image.pixels.as_raw().iter().zip(floor).filter(|(_, floor)| *floor);
        let (sum, count) = pixels.fold((0.0, 0), |(sum, count), (v, _)| (sum + f64::from(*v), count + 1));
        (count > 4000).then(|| sum / f64::from(count))
    };
    set.images().iter().zip(&shots).filter_map(of).collect()
}

#[test]
fn the_carpets_brightness_varies_as_in_the_paper() {
    // the drive of the training set
    let means = carpets(Kind::Fmrb, 7);
    let least = means.iter().copied().fold(f64::INFINITY, f64::min);
    let most = means.iter().copied().fold(0.0, f64::max);
    assert!(least <= 20.0 && (130.0..150.0).contains(&most), "{least} to {most}");
    let between = means.iter().filter(|m| (25.0..90.0).contains(*m)).count();
    assert!(between >= 3, "the way into the dark is seen");
    let means = carpets(Kind::Nsh, 4);
    assert!(means.iter().all(|m| (40.0..150.0).contains(m)), "no light is burned out there");
}

#[test]
fn other_buildings_are_other_sets() {
    let few = Some(3);
    let set = |building, changed| World::Nsh.recorded(building, changed, few).unwrap();
    let all =
        [set(None, false), set(Some(1), false), set(Some(2), false), set(None, true), set(Some(2), true)];
    for (i, a) in all.iter().enumerate() {
        assert_eq!((a.images().len(), a.cases().len()), (3, 18));
        assert!(all[..i].iter().all(|b| a.fingerprint() != b.fingerprint()));
    }
    assert_eq!(set(Some(CHANGED_BUILDING), true).fingerprint(), all[3].fingerprint());
    assert_eq!(World::Combined.recorded(Some(1), false, few).unwrap().images().len(), 3);
    assert_eq!(World::Nsh.recorded(None, false, Some(0)), Err(SetupError::Frames(0).into()));
}

/// Things and camera are others, and the hallways too: nothing of it has chosen a winner or been held out.
#[test]
fn the_changed_building_is_a_third_one() {
    for kind in Kind::ALL {
        let rooms = |seed, unseen| Plan::generate(kind, seed, unseen).rooms;
        let changed = rooms(CHANGED_BUILDING, true);
        assert!([1, 2].iter().all(|&seed| rooms(seed, false) != changed), "{kind:?}");
        assert_eq!(rooms(CHANGED_BUILDING, false), changed, "{kind:?}");
    }
}

#[test]
fn drives_keep_clear_of_everything() {
    for kind in [Kind::Nsh, Kind::Fmrb] {
        for seed in 0..6 {
            let plan = vsonar::world::office::Plan {
                people: Vec::new(),
                ..vsonar::world::office::Plan::generate(kind, seed, seed % 2 == 1)
            };
            let office = Office::build(&plan, &small(), seed).unwrap();
            let shots = drive(&office, 60, seed).unwrap();
            let mut way = 0.0;
            for pair in shots.windows(2) {
                let (a, b) = (pair[0].place, pair[1].place);
                way += (a.x - b.x).hypot(a.y - b.y);
                let clear = office.at(0.0).nearest(b.x, b.y, 1.0).distance;
                assert!(clear > 0.3, "{kind:?} {seed}: {clear}");
            }
            assert!(way > 15.0, "{kind:?} {seed}: only {way} m");
        }
    }
}

/// Whether the picture tells this label: the mean gray value of the 10 rows at and above it differs from that of the
/// 10 rows below it, in 7 columns.
fn is_visible(pixels: &image::GrayImage, x: u32, y: u32) -> bool {
    let mean = |rows: std::ops::Range<u32>| {
        let area = rows.flat_map(|y| (x.saturating_sub(3)..(x + 4).min(pixels.width())).map(move |x| (x, y)));
        let (sum, count) =
            area.fold((0u32, 0), |(sum, n), (x, y)| (sum + u32::from(pixels.get_pixel(x, y).0[0]), n + 1));
        f64::from(sum) / f64::from(count)
    };
    (mean(y.saturating_sub(9)..y + 1) - mean(y + 1..(y + 11).min(pixels.height()))).abs() >= 3.0
}

/// The labels inside the picture that it does not tell, and their share.
fn hidden(set: &Dataset) -> (f64, Vec<(usize, u32, u32)>) {
    let hidden = |case: &&vsonar::dataset::Case| {
        (1..=238).contains(&case.y) && !is_visible(&set.images()[case.image].pixels, case.x, case.y)
    };
    let hidden: Vec<_> = set.cases().iter().filter(hidden).map(|c| (c.image, c.x, c.y)).collect();
    (hidden.len() as f64 / set.cases().len() as f64, hidden)
}

#[test]
fn labels_can_be_seen() {
    // the paper's were marked by a person: what a picture does not tell cannot be among them
    let worlds = [World::Nsh, World::Fmrb, World::Combined];
    let all = worlds.map(|world| (world, hidden(&world.training())));
    assert!(all.iter().all(|(_, (share, _))| *share <= 0.03), "{all:?}");
}

#[test]
fn what_cannot_be_seen_in_other_buildings_is_in_the_dark() {
    for (building, changed) in [(1, false), (2, false), (3, false), (1, true), (CHANGED_BUILDING, true)] {
        let share = hidden(&World::Nsh.recorded(Some(building), changed, None).unwrap()).0;
        assert!(share <= 0.03, "nsh {building} {changed}: {share}");
        // How long a drive stays in the dark is left to chance there; the README states the shares. Elsewhere nothing
        // hides.
        let set = World::Fmrb.recorded(Some(building), changed, None).unwrap();
        let (share, hidden) = hidden(&set);
        println!("fmrb {building} {changed}: {share}");
        assert!(share <= 0.125, "fmrb {building} {changed}: {share}");
        let lit = hidden.iter().filter(|&&(image, x, y)| {
            let rows = y.saturating_sub(9)..(y + 11).min(set.height());
            let values = rows.map(|row| u32::from(set.images()[image].pixels.get_pixel(x, row).0[0]));
            let (sum, count) = values.fold((0, 0), |(sum, count), value| (sum + value, count + 1));
            // what is darker than 32 the digitizer does not tell apart
            sum >= 32 * count
        });
        let lit = lit.count();
        assert!(lit * 100 <= 3 * set.cases().len(), "fmrb {building} {changed}: {lit} in the light");
    }
}
