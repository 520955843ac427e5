//! How fast the synthetic offices are: pictures of 320 x 240 pixels on one thread, true answers, sonar beams.
//!
//! `cargo bench --bench world`; the throughput of `picture` is frames a second.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use vsonar::world::office::{Kind, Office, drive};

fn offices(criterion: &mut Criterion) {
    for (name, kind) in [("nsh", Kind::Nsh), ("fmrb", Kind::Fmrb)] {
        let mut group = criterion.benchmark_group(format!("world/{name}"));
        group.throughput(Throughput::Elements(1));
        group.bench_function("build", |b| b.iter(|| black_box(Office::preset(kind))));
        let office = Office::preset(kind);
        let shots = drive(&office, 40, 1).expect("it can stand there");
        // the pictures of a drive in turn, so that open floor and full views count as they occur
        let mut grabber = office.grabber(1);
        let mut turn = shots.iter().cycle();
        group.bench_function("picture", |b| {
            b.iter(|| {
                let shot = turn.next().expect("endless");
                black_box(grabber.take(&office.at(shot.seconds), &shot.place))
            });
        });
        group.bench_function("labels of 6 columns", |b| {
            b.iter(|| {
                let shot = turn.next().expect("endless");
                black_box(office.at(shot.seconds).labels(&shot.place, office.setup().labelled()))
            });
        });
        group.bench_function("sonar beam", |b| {
            b.iter(|| {
                let shot = turn.next().expect("endless");
                let place = shot.place;
                black_box(office.at(shot.seconds).range(place.x, place.y, place.heading, 4.0))
            });
        });
        group.finish();
    }
}

criterion_group!(benches, offices);
criterion_main!(benches);
