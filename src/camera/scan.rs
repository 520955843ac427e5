//! Ranges of a few columns as a laser scan, for the programs of robots that expect one.
//!
//! The fields are those of `sensor_msgs/LaserScan` of ROS: angles in radians, to the left positive, distances in
//! metres, measured along the floor from the point under the lens. A scan has evenly spaced angles that stay the same
//! from one frame to the next. The bearing of a column is neither: it depends on the row, because a pitched camera sees
//! what is near under a wider angle. So a [`Scan`] has angles over all bearings that its columns can have, as close as the
//! columns are far away, and each angle takes what the columns around it say (see [`Scan::fill`]).
//!
//! ```
//! use vsonar::camera::{Camera, ground::Ground, scan::Scan};
//!
//! let camera = Camera { height: 0.8, pitch: 51.0, field_of_view: 90.0, distortion: 0.0 };
//! let ground = Ground::new(&camera, 320, 240);
//! let columns = [40, 120, 200, 280];
//! let scan = Scan::new(&ground, &columns);
//! // What a detector answered: an obstacle on the left, floor all the way up in the next column, and so on.
//! let rows = [100.0, 0.0, 90.0, f32::NAN];
//! let ranges: Vec<_> = columns.iter().zip(rows).map(|(&column, row)| ground.locate(column, row)).collect();
//! let message = scan.fill(&ranges, 5.0, 0.1);
//! // From right to left.
//! assert!(message.angle_min < 0.0 && message.angle_max > 0.0);
//! let at = |bearing: f32| ((bearing - message.angle_min) / message.angle_increment).round() as usize;
//! assert_eq!(message.ranges[at(ranges[0].bearing)], ranges[0].distance);
//! assert_eq!(message.ranges[at(ranges[1].bearing)], f32::INFINITY);
//! ```

use super::ground::{Ground, Range};

/// The fields of a `sensor_msgs/LaserScan`, but for its header.
#[derive(Debug, Clone, PartialEq)]
pub struct LaserScan {
    /// The first angle, rightmost, in radians.
    pub angle_min: f32,
    /// The last angle.
    pub angle_max: f32,
    /// From one angle to the next; 0 where there is but one.
    pub angle_increment: f32,
    /// Seconds from one range to the next: 0, because all come from one image.
    pub time_increment: f32,
    /// Seconds from one scan to the next.
    pub scan_time: f32,
    /// Distances below this mean nothing; 0 here.
    pub range_min: f32,
    /// Distances beyond this are not given.
    pub range_max: f32,
    /// By angle, after REP 117: metres, +infinity where no obstacle is in view up to `range_max`, NaN where nothing is
    /// known.
    pub ranges: Vec<f32>,
    /// Empty: a camera measures none.
    pub intensities: Vec<f32>,
}

/// More angles than this no columns need; it bounds those of columns that are all one.
const MOST_ANGLES: usize = 4096;

/// The angles of a scan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scan {
    angle_min: f32,
    angle_max: f32,
    angles: usize,
}

impl Scan {
    /// Evenly spaced angles from the rightmost to the leftmost bearing that an obstacle in one of these columns can have,
    /// at most as far apart as the columns are on average in row 0; a single one for a single column.
    pub fn new(ground: &Ground, columns: &[u32]) -> Scan {
        let spread = |row: f32| {
            let bearings = columns.iter().map(|&column| ground.locate(column, row).bearing);
            bearings.fold((f32::INFINITY, f32::NEG_INFINITY), |(min, max), b| (min.min(b), max.max(b)))
        };
        let top = spread(0.0);
        // With a pincushion lens the widest bearing is between the top and the bottom.
        let rows = (1..=ground.last_row() as u32).map(|row| spread(row as f32));
        let (angle_min, angle_max) = rows.fold(top, |all, row| (all.0.min(row.0), all.1.max(row.1)));
        if columns.len() < 2 {
            let angle = if columns.is_empty() { 0.0 } else { (angle_min + angle_max) / 2.0 };
            return Scan { angle_min: angle, angle_max: angle, angles: columns.len() };
        }
        let apart = (top.1 - top.0) / (columns.len() - 1) as f32;
        let steps = ((angle_max - angle_min) / apart).ceil().min(MOST_ANGLES as f32) as usize;
        Scan { angle_min, angle_max, angles: steps.max(columns.len() - 1) + 1 }
    }

    /// The scan of one frame, from the ranges of its columns in any order.
    ///
    /// An angle stands for what is within half an increment of it. It takes the least distance of all columns whose
    /// bearing is there and of the column next to it by bearing, so that an obstacle is never lost to a column beside
    /// it that sees none. It is NaN where all these are invalid, and where it is beyond the outermost bearing by more
    /// than half of that column's gap to the next (and more than half an increment): there nothing was measured.
    /// Distances beyond `range_max` become +infinity. `scan_time` is the time since the last frame, in seconds.
    pub fn fill(&self, ranges: &[Range], range_max: f32, scan_time: f32) -> LaserScan {
        let increment = self.increment();
        let mut sorted: Vec<&Range> = ranges.iter().collect();
        sorted.sort_by(|a, b| a.bearing.total_cmp(&b.bearing));
        let gap = |a: usize, b: usize| match (sorted.get(a), sorted.get(b)) {
            (Some(a), Some(b)) => b.bearing - a.bearing,
            _ => 0.0,
        };
        // A single angle stands for all there is.
        let own = if self.angles < 2 { std::f32::consts::PI } else { increment / 2.0 };
        let half = |gap: f32| own.max(gap / 2.0);
        let right = half(gap(0, 1));
        let left = half(gap(sorted.len().wrapping_sub(2), sorted.len().wrapping_sub(1)));
        let at = |i: usize| {
            let angle = self.angle_min + i as f32 * increment;
            let off = |range: &Range| (range.bearing - angle).abs();
            let (Some(first), Some(last)) = (sorted.first(), sorted.last()) else { return f32::NAN };
            let within = sorted.iter().filter(|range| off(range) <= own);
            let covered = first.bearing - angle <= right && angle - last.bearing <= left;
            let next = sorted.iter().filter(|_| covered).min_by(|a, b| off(a).total_cmp(&off(b)));
            // `f32::min` passes over a NaN.
            let least = within.chain(next).map(|range| range.distance).fold(f32::NAN, f32::min);
            if least > range_max { f32::INFINITY } else { least }
        };
        LaserScan {
            angle_min: self.angle_min,
            angle_max: self.angle_max,
            angle_increment: increment,
            time_increment: 0.0,
            scan_time,
            range_min: 0.0,
            range_max,
            ranges: (0..self.angles).map(at).collect(),
            intensities: Vec::new(),
        }
    }

    fn increment(&self) -> f32 {
        if self.angles < 2 { 0.0 } else { (self.angle_max - self.angle_min) / (self.angles - 1) as f32 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Camera;

    fn ground() -> Ground {
        let camera = Camera { height: 0.8, pitch: 51.0, field_of_view: 90.0, distortion: 0.0 };
        camera.check(320, 240).expect("possible");
        Ground::new(&camera, 320, 240)
    }

    const COLUMNS: [u32; 6] = [26, 80, 133, 187, 240, 294];

    fn ranges(rows: [f32; 6]) -> Vec<Range> {
        COLUMNS.iter().zip(rows).map(|(&column, row)| ground().locate(column, row)).collect()
    }

    fn scan(rows: [f32; 6]) -> LaserScan {
        Scan::new(&ground(), &COLUMNS).fill(&ranges(rows), 6.0, 0.1)
    }

    /// The index of the angle nearest to a bearing.
    fn index(message: &LaserScan, bearing: f32) -> usize {
        ((bearing - message.angle_min) / message.angle_increment).round() as usize
    }

    #[test]
    fn angles_are_even_and_the_same_in_every_frame() {
        let (near, far) = (scan([220.0; 6]), scan([0.0; 6]));
        for message in [&near, &far] {
            assert_eq!((message.angle_min, message.angle_max), (near.angle_min, near.angle_max));
            let steps = message.ranges.len() - 1;
            assert!((6..30).contains(&steps), "{message:?}");
            let last = message.angle_min + steps as f32 * message.angle_increment;
            assert!((last - message.angle_max).abs() < 1e-5 && message.angle_increment > 0.0);
        }
        assert!((near.angle_min + near.angle_max).abs() < 0.02, "even about the middle");
        let far = ranges([0.0; 6]);
        assert!(near.angle_increment <= (far[0].bearing - far[5].bearing) / 5.0);
        let times = (near.scan_time, near.time_increment, near.range_min, near.range_max);
        assert_eq!((times, near.intensities.len()), ((0.1, 0.0, 0.0, 6.0), 0));
    }

    #[test]
    fn every_obstacle_is_in_the_scan() {
        for row in [20.0, 90.0, 150.0, 230.0, 239.0] {
            for i in 0..6 {
                let mut rows = [0.0; 6];
                rows[i] = row;
                let found = ground().locate(COLUMNS[i], row);
                let message = scan(rows);
                let there = message.ranges[index(&message, found.bearing)];
                assert_eq!(there, found.distance, "{row} {i}: {message:?}");
                assert!(message.ranges.iter().all(|&r| r.is_nan() || r == found.distance || r.is_infinite()));
            }
        }
    }

    #[test]
    fn what_is_not_known_is_not_a_number() {
        let message = scan([f32::NAN; 6]);
        assert!(message.ranges.iter().all(|r| r.is_nan()));
        // Far away the columns see less than the whole angle: its ends are not known.
        let message = scan([0.0; 6]);
        let known = message.ranges.iter().filter(|r| !r.is_nan()).count();
        assert!(
            message.ranges[0].is_nan() && message.ranges.last().is_some_and(|r| r.is_nan()),
            "{message:?}"
        );
        assert!((6..=8).contains(&known) && !message.ranges.iter().any(|r| r.is_finite()), "{message:?}");
        // A column without an answer does not hide an obstacle beside it.
        let message = scan([f32::NAN, f32::NAN, 100.0, f32::NAN, f32::NAN, f32::NAN]);
        assert!(message.ranges.iter().any(|r| r.is_finite()), "{message:?}");
    }

    #[test]
    fn with_a_pincushion_lens_every_bearing_is_between_the_ends() {
        for (pitch, field_of_view) in [(0.0, 120.0), (10.0, 90.0), (51.0, 90.0)] {
            let camera = Camera { height: 0.8, pitch, field_of_view, distortion: 0.5 };
            camera.check(320, 240).expect("possible");
            let ground = Ground::new(&camera, 320, 240);
            let scan = Scan::new(&ground, &COLUMNS);
            for row in (0..960).map(|quarter| quarter as f32 / 4.0) {
                for column in COLUMNS {
                    let found = ground.locate(column, row);
                    let message = scan.fill(&[found], 1e9, 0.1);
                    let (min, max) = (message.angle_min - 1e-4, message.angle_max + 1e-4);
                    assert!((min..=max).contains(&found.bearing), "{pitch}, {column}, {row}: {message:?}");
                    let there = message.ranges[index(&message, found.bearing)];
                    assert_eq!(there, found.distance, "{pitch}, {column}, {row}");
                }
            }
        }
    }

    #[test]
    fn beyond_the_greatest_range_nothing_is_seen() {
        let message = Scan::new(&ground(), &COLUMNS).fill(&ranges([100.0; 6]), 0.5, 0.1);
        assert!(message.ranges.iter().all(|&r| r == f32::INFINITY || r.is_nan()), "{message:?}");
    }

    #[test]
    fn few_columns() {
        let ground = ground();
        let none = Scan::new(&ground, &[]).fill(&[], 6.0, 0.1);
        assert_eq!((none.ranges.len(), none.angle_min, none.angle_increment), (0, 0.0, 0.0));
        let one = Scan::new(&ground, &[160]);
        let range = ground.locate(160, 50.0);
        assert_eq!(one.fill(&[range], 6.0, 0.1).ranges, [range.distance]);
        assert!(one.fill(&[], 6.0, 0.1).ranges[0].is_nan());
        let same = Scan::new(&ground, &[160, 160]).fill(&[range, range], 6.0, 0.1);
        assert!(same.ranges.len() <= MOST_ANGLES + 1 && same.ranges.contains(&range.distance), "{same:?}");
    }
}
