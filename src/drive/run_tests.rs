use super::*;
use crate::drive::wander::{Reach, Reading, View};
use crate::world::office::{Kind, Setup};

/// Says the same all the time.
struct Fixed(Reach);

impl RangeSource for Fixed {
    fn ahead(&self) -> f64 {
        0.0
    }

    fn sees(&self) -> bool {
        false
    }

    fn view(&self) -> View {
        View::Fan { half_angle: 0.4, farthest: 5.0 }
    }

    fn restart(&mut self, _: u64) {}

    fn readings(&mut self, _: &Sight<'_>, readings: &mut Vec<Reading>) -> Result<(), DetectError> {
        readings.clear();
        readings.extend([-0.4, 0.0, 0.4].map(|bearing| Reading { bearing, reach: self.0 }));
        Ok(())
    }

    fn rows(&self) -> Option<&Rows> {
        None
    }
}

fn driven(reach: Reach, seconds: f64) -> Run {
    let office = Office::new(Kind::Fmrb, 1);
    let settings = Settings { seconds, ..Settings::default() };
    let run = drive(&office, &mut Fixed(reach), &settings, 2, &AtomicBool::new(false), |_| Ok(()));
    run.expect("nothing is detected").expect("nobody stops it")
}

#[test]
fn no_run_begins_where_the_body_cannot_stand() {
    let plan = "plan 1\nroom 0 12 -1.2 1.2\nstart 6 0 0\nstart 6 1.2 0\n".parse().expect("a plan");
    let office = Office::build(&plan, &Setup::default(), 1).expect("sound");
    let settings = Settings { seconds: 0.2, ..Settings::default() };
    let run = |number| {
        let mut source = Fixed(Reach::Free(5.0));
        drive(&office, &mut source, &settings, number, &AtomicBool::new(false), |_| Ok(()))
    };
    assert!(run(0).is_ok());
    assert!(matches!(run(1), Err(DriveError::Start(OfficeError::Start { start: 1, .. }))));
}

#[test]
fn the_blind_hit_walls_where_their_body_touches_them() {
    let run = driven(Reach::Free(5.0), 600.0);
    let hit = run.hit.expect("it sees nothing");
    assert_eq!(run.end, End::Collision);
    assert!(!hit.walked_into && run.metres > 0.2 && run.seconds < 300.0, "{run:?}");
    let office = Office::new(Kind::Fmrb, 1);
    let &(x, y) = run.path.last().expect("it has been somewhere");
    let nearest = office.at(run.seconds).nearest(x, y, 1.0);
    // It went on for at most a step after the touch.
    assert!(nearest.distance < 0.24 && nearest.distance > 0.24 - 0.3 / 50.0 - 1e-9, "{nearest:?}");
    let way: f64 = run.path.windows(2).map(|w| libm::hypot(w[1].0 - w[0].0, w[1].1 - w[0].1)).sum();
    assert!((way / run.metres - 1.0).abs() < 0.02, "{way} {}", run.metres);
}

#[test]
fn who_sees_walls_everywhere_is_stuck_and_who_knows_nothing_stands_still() {
    for (reach, turning) in [(Reach::Obstacle(0.3), 0.9..=1.0), (Reach::Unknown, 0.0..=0.0)] {
        let run = driven(reach, 600.0);
        assert_eq!((run.end, run.hit), (End::Stuck, None));
        assert_eq!((run.seconds, run.metres), (60.0, 0.0));
        assert!(turning.contains(&run.turning), "{run:?}");
    }
}

#[test]
fn time_is_over_and_ctrl_c_is_heard() {
    let run = driven(Reach::Unknown, 3.0);
    assert_eq!((run.end, run.seconds), (End::Limit, 3.0));
    let run = driven(Reach::Free(5.0), 1.7);
    assert_eq!((run.end, run.path.len()), (End::Limit, 5), "twice a second, and where it was at the end");
    let way: f64 = run.path.windows(2).map(|w| libm::hypot(w[1].0 - w[0].0, w[1].1 - w[0].1)).sum();
    assert!((way / run.metres - 1.0).abs() < 0.02, "{way} {}", run.metres);
    let office = Office::new(Kind::Fmrb, 1);
    let stopped =
        drive(&office, &mut Fixed(Reach::Unknown), &Settings::default(), 0, &AtomicBool::new(true), |_| {
            Ok(())
        });
    assert!(stopped.expect("nothing fails").is_none());
}
