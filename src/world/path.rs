//! A drive through the corridor: the robot wanders from side to side, looks around, and comes close to walls.

use super::Corridor;
use super::building::Building;
use super::camera::Pose;
use super::noise::{Stream, smooth};

/// Distance the camera keeps from everything, in metres.
const CLEARANCE: f64 = 0.33;
/// How many places are tried for a frame before the best of them is taken.
const TRIES: u32 = 64;

/// The poses of a drive of this many frames, in time order.
pub(super) fn poses(building: &Building, settings: &Corridor, seed: u64, frames: usize) -> Vec<Pose> {
    let total: f64 = building.legs.iter().map(|leg| leg.length()).sum();
    let mut stream = Stream::new(seed, 7);
    let salt = stream.bits();
    (0..frames)
        .map(|frame| {
            let mut best: Option<(f64, Pose)> = None;
            for _ in 0..TRIES {
                let along = total * (frame as f64 + stream.unit()) / frames as f64;
                let pose = pose(building, settings, salt, along, &mut stream);
                let clear = building.geometry.clearance(pose.x, pose.y, CLEARANCE);
                if best.is_none_or(|(most, _)| clear > most) {
                    best = Some((clear, pose));
                }
                if clear >= CLEARANCE {
                    break;
                }
            }
            // there is a best after at least one try
            best.map_or(Pose { x: 0.0, y: 0.0, z: 1.0, yaw: 0.0, pitch: 1.0 }, |(_, pose)| pose)
        })
        .collect()
}

/// The pose so far along the whole corridor, give and take what the stream adds.
fn pose(building: &Building, settings: &Corridor, salt: u64, along: f64, stream: &mut Stream) -> Pose {
    let (mut rest, mut leg) = (along, building.legs[0]);
    for next in &building.legs {
        leg = *next;
        if rest <= leg.length() {
            break;
        }
        rest -= leg.length();
    }
    // smooth wandering, and a little at random on top of it
    let wander =
        |salt_add: u64, every: f64| 2.0 * smooth(salt.wrapping_add(salt_add), along / every, 0.5) - 1.0;
    let room = (leg.width / 2.0 - CLEARANCE).max(0.0);
    let left = (1.3 * wander(1, 2.3) + stream.range(-0.2, 0.2)).clamp(-1.0, 1.0) * room;
    let (x, y) = leg.point(rest, left);
    let turn = 1.35 * wander(2, 1.7) + stream.range(-0.25, 0.25);
    let heading = libm::atan2(leg.heading.1, leg.heading.0);
    Pose {
        x,
        y,
        z: settings.camera_height + stream.range(-0.004, 0.004),
        yaw: heading + turn,
        pitch: settings.pitch + stream.range(-0.01, 0.01),
    }
}
