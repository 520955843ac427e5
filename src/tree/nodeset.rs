//! The set of node types that random trees are made of, each with a weight.

use std::borrow::Cow;
use std::str::FromStr;

use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};

use super::error::{quote, suggestion};
use super::individual::TreeIndex;
use super::node::{Node, NodeType};
use super::place::Place;

/// The largest weight.
pub const MAX_WEIGHT: u32 = 1_000;

/// The node types in use, with their weights: how much likelier than one of weight 1 a type is drawn among those
/// that fit a place. At first every type has weight 1.
///
/// Written as edits of that full set, separated by spaces or commas: `-raw` takes a type out, `+raw` puts it
/// back, `if-le=2` gives it a weight; a trailing `*` stands for all names that begin so, as in `-median*`. Random
/// constants are the type `constant`.
///
/// ```
/// use vsonar::tree::{NodeSet, NodeType};
///
/// let set: NodeSet = "-moravec* +moravec-slash, if-le=2".parse()?;
/// assert_eq!(set.weight(NodeType::from_name("moravec-vertical").unwrap()), 0);
/// assert_eq!(set.weight(NodeType::from_name("if-le").unwrap()), 2);
/// assert_eq!(set.to_string().parse(), Ok(set));
/// # Ok::<(), vsonar::tree::NodeSetError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NodeSet {
    /// By number of type.
    weights: Vec<u32>,
}

/// Why a set of node types cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NodeSetError {
    /// An edit of another form.
    #[error("{0} is not an edit of the node set; write `-name`, `+name` or `name=weight`")]
    Edit(String),
    /// No type has this name.
    #[error("unknown node {name} in {edit}{}", .suggestion.map_or_else(String::new, |s| format!("; did you mean `{s}`?")))]
    Unknown {
        /// The name, quoted.
        name: String,
        /// The edit, quoted.
        edit: String,
        /// The node with the nearest name, if one is near.
        suggestion: Option<&'static str>,
    },
    /// A weight that is no whole number up to [`MAX_WEIGHT`].
    #[error("the weight in {0} is not a whole number from 0 to {MAX_WEIGHT}")]
    Weight(String),
    /// A place that nothing fits any more.
    #[error("the node set leaves no {what} for the {place}; put one back, as in `+{example}`")]
    Lacking {
        /// `function` or `leaf`, or `size` for rectangles.
        what: &'static str,
        /// The place.
        place: Place,
        /// A type that would do.
        example: &'static str,
    },
}

impl Default for NodeSet {
    fn default() -> NodeSet {
        NodeSet { weights: vec![1; NodeType::count()] }
    }
}

impl NodeSet {
    /// The set in which each type has the weight that `weight` gives it, at most [`MAX_WEIGHT`].
    pub fn of_weights(weight: impl Fn(NodeType) -> u32) -> NodeSet {
        NodeSet { weights: NodeType::all().map(|node| weight(node).min(MAX_WEIGHT)).collect() }
    }

    /// The weight of a type; 0 if it is not in the set.
    pub fn weight(&self, node_type: NodeType) -> u32 {
        self.weights[node_type.index()]
    }

    /// Applies edits to the set as it is.
    ///
    /// # Errors
    /// If an edit is malformed or names no type. The set is then unchanged.
    pub fn edit(&mut self, edits: &str) -> Result<(), NodeSetError> {
        let mut weights = self.weights.clone();
        for edit in edits.split([' ', ',', '\t', '\n', '\r']).filter(|edit| !edit.is_empty()) {
            let (name, weight) = Self::parse_edit(edit)?;
            for node_type in matching(name, edit)? {
                weights[node_type.index()] = weight;
            }
        }
        self.weights = weights;
        Ok(())
    }

    fn parse_edit(edit: &str) -> Result<(&str, u32), NodeSetError> {
        if let Some((name, weight)) = edit.rsplit_once('=') {
            let weight = weight.parse().ok().filter(|&w: &u32| w <= MAX_WEIGHT);
            return Ok((name, weight.ok_or_else(|| NodeSetError::Weight(quote(edit)))?));
        }
        let signed = [('-', 0), ('+', 1)].into_iter().find_map(|(s, w)| Some((edit.strip_prefix(s)?, w)));
        signed.filter(|(name, _)| !name.is_empty()).ok_or_else(|| NodeSetError::Edit(quote(edit)))
    }

    /// The types in the set that fit a place, with their weights, in the order of the table.
    pub fn fitting(
        &self,
        place: Place,
        which: TreeIndex,
        function: bool,
    ) -> impl Iterator<Item = (Node, u32)> + '_ {
        NodeType::all()
            .map(|t| (t.node(), self.weight(t)))
            .filter(move |&(node, weight)| weight > 0 && suits(node, place, which, function))
    }

    /// Checks that trees can be made of the set.
    ///
    /// # Errors
    /// [`NodeSetError::Lacking`] if it leaves no root, no rectangle, or no function or no leaf for a column
    /// expression or a body. What only a second tree can hold does not count.
    pub fn check(&self) -> Result<(), NodeSetError> {
        let needs = [
            (Place::Root, true, "iterate node", "iterate-up"),
            (Place::Rect, false, "size", "3x3"),
            (Place::Column, true, "function", "+"),
            (Place::Column, false, "leaf", "x-obstacle"),
            (Place::Body, true, "function", "if-le"),
            (Place::Body, false, "leaf", "gradient"),
        ];
        for (place, function, what, example) in needs {
            if self.fitting(place, TreeIndex::First, function).next().is_none() {
                return Err(NodeSetError::Lacking { what, place, example });
            }
        }
        Ok(())
    }
}

/// Whether a node can be drawn for a place.
fn suits(node: Node, place: Place, which: TreeIndex, function: bool) -> bool {
    let readable = which == TreeIndex::Second || !matches!(node, Node::Iter2(_));
    node.fits(place) && node.is_function() == function && readable
}

/// The types that a name in an edit stands for.
fn matching(name: &str, edit: &str) -> Result<Vec<NodeType>, NodeSetError> {
    // The multiplication has a name that is a star.
    if let Some(exact) = NodeType::from_name(name) {
        return Ok(vec![exact]);
    }
    let prefix = name.strip_suffix('*').filter(|prefix| !prefix.is_empty());
    let found: Vec<_> =
        prefix.map_or_else(Vec::new, |p| NodeType::all().filter(|t| t.name().starts_with(p)).collect());
    if found.is_empty() {
        let suggestion = suggestion(name.trim_start_matches(['+', '-']));
        return Err(NodeSetError::Unknown { name: quote(name), edit: quote(edit), suggestion });
    }
    Ok(found)
}

/// The edits that make the set of the full one, in the order of the table.
impl std::fmt::Display for NodeSet {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut space = "";
        for node_type in NodeType::all() {
            match self.weight(node_type) {
                1 => continue,
                0 => write!(f, "{space}-{node_type}")?,
                weight => write!(f, "{space}{node_type}={weight}")?,
            }
            space = " ";
        }
        Ok(())
    }
}

impl FromStr for NodeSet {
    type Err = NodeSetError;

    fn from_str(edits: &str) -> Result<NodeSet, NodeSetError> {
        let mut set = NodeSet::default();
        set.edit(edits)?;
        Ok(set)
    }
}

impl Serialize for NodeSet {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for NodeSet {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<NodeSet, D::Error> {
        Cow::<'de, str>::deserialize(deserializer)?.parse().map_err(D::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn weight(set: &NodeSet, name: &str) -> u32 {
        set.weight(NodeType::from_name(name).expect("a node's name"))
    }

    fn message(edits: &str) -> String {
        edits.parse::<NodeSet>().and_then(|set| set.check()).expect_err("a faulty set").to_string()
    }

    #[test]
    fn edits_apply_in_order_and_print_back() {
        let edits = "-raw -raw-sq,+sin -median* +median if-le=2 -* -=3 -+ ++ constant=7";
        let set: NodeSet = edits.parse().expect("sound edits");
        let expected = [
            ("raw", 0),
            ("sin", 1),
            ("median", 1),
            ("median-corner-sq", 0),
            ("if-le", 2),
            ("*", 0),
            ("-", 3),
            ("+", 1),
            ("constant", 7),
            ("gradient", 1),
        ];
        for (name, expected) in expected {
            assert_eq!(weight(&set, name), expected, "{name}");
        }
        let printed = set.to_string();
        assert_eq!(
            printed,
            "-=3 -* constant=7 if-le=2 -raw -raw-sq -median-sq -median-corner -median-corner-sq"
        );
        assert_eq!(printed.parse(), Ok(set));
        assert_eq!(NodeSet::default().to_string(), "");
    }

    #[test]
    fn faults_are_named() {
        assert_eq!(
            message("sin"),
            "`sin` is not an edit of the node set; write `-name`, `+name` or `name=weight`"
        );
        assert_eq!(
            message("-raw -gradent"),
            "unknown node `gradent` in `-gradent`; did you mean `gradient`?"
        );
        assert_eq!(message("-zzz*"), "unknown node `zzz*` in `-zzz*`");
        assert_eq!(message("sin=-1"), "the weight in `sin=-1` is not a whole number from 0 to 1000");
        assert_eq!(
            message("-iterate*"),
            "the node set leaves no iterate node for the root; put one back, as in `+iterate-up`"
        );
        assert_eq!(
            message("-x-obstacle -window-area -image-max* -constant"),
            "the node set leaves no leaf for the column expression; put one back, as in `+x-obstacle`"
        );
    }

    #[test]
    fn a_faulty_edit_changes_nothing() {
        let mut set = NodeSet::default();
        assert!(set.edit("-raw -nonsense").is_err());
        assert_eq!(set, NodeSet::default());
    }
}
