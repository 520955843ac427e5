//! What tells the members of a family of node types apart: a direction, a rectangle, a register, an operand.

use vsonar_ir::op::REGISTER_NAMES;
use vsonar_ir::{Direction, Operand, Rect};

/// The payload of a family of node types.
pub(super) trait Payload: Copy {
    /// How many members there are.
    const COUNT: usize;
    /// The member's number, below the count.
    fn number(self) -> usize;
    /// The member of this number.
    fn member(number: usize) -> Self;
    /// What the member's name ends with.
    fn label(self) -> String;
}

impl Payload for Direction {
    const COUNT: usize = 2;
    fn number(self) -> usize {
        self as usize
    }
    fn member(number: usize) -> Direction {
        [Direction::Up, Direction::Down][number]
    }
    fn label(self) -> String {
        self.name().to_string()
    }
}

impl Payload for Rect {
    const COUNT: usize = Rect::COUNT;
    fn number(self) -> usize {
        self.index()
    }
    fn member(number: usize) -> Rect {
        Rect::from_index(number).expect("below the count")
    }
    fn label(self) -> String {
        self.to_string()
    }
}

impl Payload for Operand {
    const COUNT: usize = Operand::COUNT;
    fn number(self) -> usize {
        usize::from(self.index())
    }
    fn member(number: usize) -> Operand {
        Operand::from_index(number as u8).expect("below the count")
    }
    fn label(self) -> String {
        self.name().to_string()
    }
}

/// A register's number.
impl Payload for u8 {
    const COUNT: usize = REGISTER_NAMES.len();
    fn number(self) -> usize {
        usize::from(self)
    }
    fn member(number: usize) -> u8 {
        number as u8
    }
    fn label(self) -> String {
        REGISTER_NAMES[usize::from(self)].to_string()
    }
}

/// A constant: one type, whatever its value.
impl Payload for f32 {
    const COUNT: usize = 1;
    fn number(self) -> usize {
        0
    }
    fn member(_number: usize) -> f32 {
        0.0
    }
    fn label(self) -> String {
        String::new()
    }
}
