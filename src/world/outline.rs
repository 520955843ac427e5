//! The walls around a union of rooms.

use super::geometry::{Room, Wall};

/// The boundary of the union of the rooms, as walls that face the inside.
pub(super) fn outline(rooms: &[Room]) -> Vec<Wall> {
    let mut walls = Vec::new();
    for (i, room) in rooms.iter().enumerate() {
        for (along_y, facing) in [(true, 1.0), (true, -1.0), (false, 1.0), (false, -1.0)] {
            let (across, span) = if along_y { (room.x, room.y) } else { (room.y, room.x) };
            let at = if facing > 0.0 { across.0 } else { across.1 };
            // where another room lies behind this side, there is no wall
            let mut open: Vec<(f64, f64)> = Vec::new();
            for (j, other) in rooms.iter().enumerate() {
                let (across, span) = if along_y { (other.x, other.y) } else { (other.y, other.x) };
                let behind = if facing > 0.0 {
                    across.0 < at && at <= across.1
                } else {
                    across.0 <= at && at < across.1
                };
                // two rooms that end on the same line have one wall there: the first one's
                let first = j < i && at == if facing > 0.0 { across.0 } else { across.1 };
                if j != i && (behind || first) {
                    open.push(span);
                }
            }
            let closed = subtract(span, open);
            walls.extend(closed.into_iter().map(|span| Wall { along_y, at, span, facing }));
        }
    }
    walls
}

/// What of a stretch remains without the others.
fn subtract(whole: (f64, f64), mut cuts: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    cuts.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut rest, mut from) = (Vec::new(), whole.0);
    for (low, high) in cuts {
        if low > from && from < whole.1 {
            rest.push((from, low.min(whole.1)));
        }
        from = from.max(high);
    }
    if from < whole.1 {
        rest.push((from, whole.1));
    }
    rest
}

#[cfg(test)]
mod tests {
    use super::*;

    fn total(walls: &[Wall]) -> f64 {
        walls.iter().map(Wall::length).sum()
    }

    #[test]
    fn one_room_has_four_walls() {
        let walls = outline(&[Room { x: (0.0, 3.0), y: (0.0, 2.0) }]);
        assert_eq!((walls.len(), total(&walls)), (4, 10.0));
        for wall in &walls {
            let (x, y) = wall.foot((wall.span.0 + wall.span.1) / 2.0);
            let n = wall.normal();
            assert!((0.0..3.0).contains(&(x + 0.1 * n.x)) && (0.0..2.0).contains(&(y + 0.1 * n.y)));
        }
    }

    #[test]
    fn an_l_of_two_rooms_has_no_wall_inside() {
        let a = Room { x: (0.0, 4.0), y: (0.0, 1.0) };
        let b = Room { x: (3.0, 4.0), y: (0.0, 5.0) };
        let walls = outline(&[a, b]);
        assert_eq!(total(&walls), 18.0, "{walls:?}");
        assert_eq!(total(&outline(&[b, a])), 18.0);
        // touching rooms are one space, equal rooms are one room
        let c = Room { x: (4.0, 6.0), y: (0.0, 1.0) };
        assert_eq!(total(&outline(&[a, c])), 14.0);
        assert_eq!(total(&outline(&[a, a])), 10.0);
    }

    #[test]
    fn stretches_are_subtracted() {
        assert_eq!(subtract((0.0, 10.0), vec![]), [(0.0, 10.0)]);
        assert_eq!(subtract((0.0, 10.0), vec![(4.0, 5.0), (-1.0, 2.0)]), [(2.0, 4.0), (5.0, 10.0)]);
        assert_eq!(subtract((0.0, 10.0), vec![(1.0, 9.0), (2.0, 3.0)]), [(0.0, 1.0), (9.0, 10.0)]);
        assert_eq!(subtract((0.0, 10.0), vec![(-5.0, 20.0)]), []);
        assert_eq!(subtract((0.0, 10.0), vec![(12.0, 20.0)]), [(0.0, 10.0)]);
    }
}
