//! Throwaway: the old example map drawn anew.
use vsonar::drive::map;
use vsonar::drive::run::{End, Hit, Run};
use vsonar::world::office::{Kind, Office, Thing};
fn main() {
    let old = std::fs::read_to_string(std::env::args().nth(1).unwrap()).unwrap();
    let points = old.split("<polyline points=\"").nth(1).unwrap().split('"').next().unwrap();
    let office = Office::preset(Kind::Fmrb);
    let left = office.rooms().iter().map(|r| r.x.0).fold(f64::INFINITY, f64::min) - 0.6;
    let top = office.rooms().iter().map(|r| r.y.1).fold(f64::NEG_INFINITY, f64::max) + 0.6;
    let back = |x: f64, y: f64| (left + x / 40.0, top - y / 40.0);
    let path: Vec<(f64, f64)> = points
        .split(' ')
        .map(|p| {
            let (x, y) = p.split_once(',').unwrap();
            back(x.parse().unwrap(), y.parse().unwrap())
        })
        .collect();
    let seconds = 639.0;
    let hit = Hit { thing: Thing::Wall, point: back(280.0, 54.0), in_view: true, walked_into: false };
    eprintln!("{} places", path.len());
    let run = Run {
        number: 1,
        end: End::Collision,
        hit: Some(hit),
        metres: 189.1,
        seconds,
        turning: 0.0,
        squares: 0,
        accuracy: None,
        path,
    };
    print!(
        "{}",
        map::svg(
            &office,
            &run,
            0.24,
            "Run 1 of program in fmrb, the building of the training set",
            "189.1 m in 10:39, hit a table, in view"
        )
    );
}
