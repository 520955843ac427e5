//! The one table of node types.
//!
//! A row gives a type's name, its number of arguments, its group, the [`Place`]s of a tree where it may stand, and the
//! IR operation that it is, if it is one. Parser, printer, random creation, lowering of operations and the settings of the
//! node set derive from it; nowhere is there a second list. A row with a payload is a family, one type for each value of the payload: `set-` with a
//! register is `set-a` … `set-e`.
//!
//! ```
//! use vsonar::tree::{Node, NodeType, Place};
//!
//! let node_type = NodeType::from_name("if-le").unwrap();
//! assert_eq!((node_type.node(), node_type.arity()), (Node::IfLe, 4));
//! assert!(node_type.fits(Place::Body) && !node_type.fits(Place::Rect));
//! ```

use std::hash::{Hash, Hasher};
use std::sync::LazyLock;

use vsonar_ir::op::REGISTER_NAMES;
use vsonar_ir::{Direction, Op, Operand, Rect};

use super::payload::Payload;
use super::place::{Group, Place};

macro_rules! nodes {
    ($( $(#[$doc:meta])* $variant:ident $(($payload:ty))? $name:literal / $arity:literal
        $group:ident [$($place:ident)*] $(= $op:ident)?; )*) => {
        /// A node of a tree. Equality and hashing are by the bits of a constant, so that 0 and -0 differ.
        #[derive(Debug, Clone, Copy)]
        pub enum Node {
            $( $(#[$doc])* $variant $(($payload))?, )*
        }

        /// The rows of the table by number, for the position of their families among the types.
        #[derive(Clone, Copy)]
        enum Row { $( $variant, )* }

        /// How many types each row has.
        const ROW_TYPES: &[usize] = &[ $( nodes!(@count $($payload)?), )* ];

        impl Node {
            /// How many arguments the node has; none for a leaf.
            #[inline]
            pub const fn arity(self) -> usize {
                match self { $( nodes!(@pattern $variant $($payload)?) => $arity, )* }
            }

            /// The node's group.
            pub const fn group(self) -> Group {
                match self { $( nodes!(@pattern $variant $($payload)?) => Group::$group, )* }
            }

            /// The places where the node may stand (`iter2-*` in second trees only).
            pub const fn places(self) -> &'static [Place] {
                match self { $( nodes!(@pattern $variant $($payload)?) => &[ $( Place::$place ),* ], )* }
            }

            /// The IR operation that is applied to the arguments' values, if the node is one.
            pub const fn operation(self) -> Option<Op> {
                match self { $( nodes!(@pattern $variant $($payload)?) => nodes!(@operation $($op)?), )* }
            }

            /// The row of the table, and the payload's number within it.
            fn row(self) -> (Row, usize) {
                match self { $( nodes!(@bind $variant p $($payload)?) =>
                    (Row::$variant, nodes!(@number p $($payload)?)), )* }
            }
        }

        /// A node and the name of every type, in the order of the table.
        fn all_types() -> Vec<(Node, String)> {
            let mut types = Vec::new();
            $( nodes!(@members types $variant $name $($payload)?); )*
            types
        }
    };
    (@count) => { 1 };
    (@count $payload:ty) => { <$payload as Payload>::COUNT };
    (@pattern $variant:ident) => { Node::$variant };
    (@pattern $variant:ident $payload:ty) => { Node::$variant(_) };
    (@bind $variant:ident $p:ident) => { Node::$variant };
    (@bind $variant:ident $p:ident $payload:ty) => { Node::$variant($p) };
    (@operation) => { None };
    (@operation $op:ident) => { Some(Op::$op) };
    (@number $p:ident) => { 0 };
    (@number $p:ident $payload:ty) => { $p.number() };
    (@members $types:ident $variant:ident $name:literal) => {
        $types.push((Node::$variant, $name.to_string()));
    };
    (@members $types:ident $variant:ident $name:literal $payload:ty) => {
        for number in 0..<$payload as Payload>::COUNT {
            let payload = <$payload as Payload>::member(number);
            $types.push((Node::$variant(payload), format!("{}{}", $name, payload.label())));
        }
    };
}

nodes! {
    /// `(iterate-up RECT COLUMN BODY)`, `(iterate-down RECT COLUMN BODY)`: runs the body at every position of
    /// the rectangle in the column.
    Iterate(Direction) "iterate-" / 3 Root [Root];
    /// `3x8`: a rectangle size, width x height in pixels.
    Rect(Rect) "" / 0 Rectangle [Rect];
    /// `(+ A B)`.
    Add "+" / 2 Arithmetic [Column Body] = Add;
    /// `(- A B)`.
    Sub "-" / 2 Arithmetic [Column Body] = Sub;
    /// `(* A B)`.
    Mul "*" / 2 Arithmetic [Column Body] = Mul;
    /// `(% A B)`: 1 where B is zero of either sign, whatever A is, else A / B (Koza 1992).
    Div "%" / 2 Arithmetic [Column Body] = PDiv;
    /// `(square A)`: A · A.
    Square "square" / 1 Arithmetic [Column Body];
    /// `(sin A)`, A in radians.
    Sin "sin" / 1 Arithmetic [Column Body] = Sin;
    /// `(cos A)`, A in radians.
    Cos "cos" / 1 Arithmetic [Column Body] = Cos;
    /// `(tan A)`, A in radians.
    Tan "tan" / 1 Arithmetic [Column Body] = Tan;
    /// `(atan A)`, in radians.
    Atan "atan" / 1 Arithmetic [Column Body] = Atan;
    /// `(atan2 A B)`: the angle of the point with ordinate A and abscissa B, in radians.
    Atan2 "atan2" / 2 Arithmetic [Column Body] = Atan2;
    /// `(min A B)`: A where A < B, else B.
    Min "min" / 2 Arithmetic [Column Body] = Min;
    /// `(max A B)`: A where A > B, else B.
    Max "max" / 2 Arithmetic [Column Body] = Max;
    /// `x-obstacle`: the column asked for, in pixels.
    XObstacle "x-obstacle" / 0 Parameter [Column Body];
    /// `window-area`: pixels in the rectangle.
    WindowArea "window-area" / 0 Parameter [Column Body];
    /// `image-max-x`: the image's width less 1.
    ImageMaxX "image-max-x" / 0 Parameter [Column Body];
    /// `image-max-y`: the image's height less 1.
    ImageMaxY "image-max-y" / 0 Parameter [Column Body];
    /// `first-window`: 1 at the first position of the iteration, else -1.
    FirstWindow "first-window" / 0 Parameter [Body];
    /// `x`: the rectangle's centre column, in pixels, after rounding and clamping.
    X "x" / 0 Parameter [Body];
    /// `y`: the rectangle's centre row, in pixels from the top.
    Y "y" / 0 Parameter [Body];
    /// A finite constant, written as a decimal number.
    Constant(f32) "constant" / 0 Constant [Column Body];
    /// `(prog2 A B)`: evaluates both, and has the value of B.
    Prog2 "prog2" / 2 Flow [Body];
    /// `(prog3 A B C)`: evaluates all, and has the value of C.
    Prog3 "prog3" / 3 Flow [Body];
    /// `break`: ends this tree's iteration at once.
    Break "break" / 0 Flow [Body];
    /// `(if-le A B C D)`: C where A <= B, else D; only that one is evaluated.
    IfLe "if-le" / 4 Flow [Body];
    /// `(set-a A)` … `(set-e A)`: stores A in a register (0 to 4) and has its value.
    Set(u8) "set-" / 1 Memory [Body];
    /// `read-a` … `read-e`: the value of a register, 0 to 4.
    Read(u8) "read-" / 0 Memory [Body];
    /// `iter2-a` … `iter2-e`: a final register (0 to 4) of the first tree, in the second tree.
    Iter2(u8) "iter2-" / 0 Iter2 [Column Body];
    /// `gradient`, `gradient-sq`: the average of an image operator, or of its square, over the window.
    Image(Operand) "" / 0 Image [Body];
}

/// Every type: a node of it (a constant of value 0) and its name.
static TYPES: LazyLock<Vec<(Node, String)>> = LazyLock::new(all_types);

impl Node {
    /// The name in program text; `constant` for a constant.
    ///
    /// # Panics
    /// On a register above 4, which no [`Tree`](super::Tree) holds.
    pub fn name(self) -> &'static str {
        self.node_type().name()
    }

    /// The node's type.
    ///
    /// # Panics
    /// As [`Node::name`].
    pub fn node_type(self) -> NodeType {
        let (row, number) = self.row();
        assert!(number < ROW_TYPES[row as usize], "no register has the number {number}");
        NodeType((ROW_TYPES[..row as usize].iter().sum::<usize>() + number) as u8)
    }

    /// Whether the node may stand in this place (`iter2-*` in second trees only).
    #[inline]
    pub fn fits(self, place: Place) -> bool {
        self.places().contains(&place)
    }

    /// Whether the node has arguments.
    #[inline]
    pub const fn is_function(self) -> bool {
        self.arity() > 0
    }

    /// Whether the numbers inside are ones the language has: registers below 5, constants finite.
    pub(super) fn is_sound(self) -> bool {
        match self {
            Node::Set(register) | Node::Read(register) | Node::Iter2(register) => {
                usize::from(register) < REGISTER_NAMES.len()
            }
            Node::Constant(value) => value.is_finite(),
            _ => true,
        }
    }

    /// What tells nodes apart: row, payload, and the bits of a constant.
    fn identity(self) -> (u8, u32) {
        let (row, number) = self.row();
        let bits = if let Node::Constant(value) = self { value.to_bits() } else { number as u32 };
        (row as u8, bits)
    }
}

impl PartialEq for Node {
    fn eq(&self, other: &Node) -> bool {
        self.identity() == other.identity()
    }
}

impl Eq for Node {}

impl Hash for Node {
    fn hash<H: Hasher>(&self, state: &mut H) {
        let (row, bits) = self.identity();
        state.write_u64(u64::from(row) << 32 | u64::from(bits));
    }
}

/// A node type: a row of the table, or one member of a family. All constants are one type.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct NodeType(u8);

impl NodeType {
    /// How many types there are.
    pub fn count() -> usize {
        TYPES.len()
    }

    /// All types, in the order of the table.
    pub fn all() -> impl ExactSizeIterator<Item = NodeType> {
        (0..TYPES.len()).map(|i| NodeType(i as u8))
    }

    /// The type of this name.
    pub fn from_name(name: &str) -> Option<NodeType> {
        NodeType::all().find(|t| t.name() == name)
    }

    /// Position in the table.
    pub fn index(self) -> usize {
        usize::from(self.0)
    }

    /// A node of this type; for constants, 0.
    pub fn node(self) -> Node {
        TYPES[self.index()].0
    }

    /// The name in program text; `constant` for constants.
    pub fn name(self) -> &'static str {
        &TYPES[self.index()].1
    }

    /// See [`Node::arity`].
    pub fn arity(self) -> usize {
        self.node().arity()
    }

    /// See [`Node::fits`].
    pub fn fits(self, place: Place) -> bool {
        self.node().fits(place)
    }
}

impl std::fmt::Display for NodeType {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn types_and_names_agree() {
        assert_eq!(NodeType::count(), 76);
        for (i, node_type) in NodeType::all().enumerate() {
            assert_eq!(node_type.index(), i);
            assert_eq!(NodeType::from_name(node_type.name()), Some(node_type));
            assert_eq!(node_type.node().node_type(), node_type);
        }
        assert_eq!(Node::Set(4).name(), "set-e");
        assert_eq!(Node::Iterate(Direction::Down).name(), "iterate-down");
        assert_eq!(Node::Rect(Rect::new(3, 8).expect("in the list")).name(), "3x8");
        assert_eq!(Node::Constant(2.5).name(), "constant");
    }

    #[test]
    fn a_node_is_small_and_compares_by_bits() {
        assert!(size_of::<Node>() <= 8);
        assert_ne!(Node::Constant(0.0), Node::Constant(-0.0));
        assert_eq!(Node::Constant(1.5), Node::Constant(1.5));
        assert_ne!(Node::Read(1), Node::Read(2));
        assert_ne!(Node::Read(1), Node::Set(1));
    }

    #[test]
    fn window_dependent_nodes_stay_out_of_columns() {
        for node_type in NodeType::all().filter(|t| t.fits(Place::Column)) {
            let node = node_type.node();
            let columnar = matches!(node.group(), Group::Arithmetic | Group::Constant | Group::Iter2)
                || matches!(node, Node::XObstacle | Node::WindowArea | Node::ImageMaxX | Node::ImageMaxY);
            assert!(columnar && node_type.fits(Place::Body), "{node_type}");
        }
        assert_eq!(NodeType::all().filter(|t| t.fits(Place::Column)).count(), 12 + 4 + 1 + 5);
    }
}
