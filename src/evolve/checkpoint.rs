//! Checkpoints: the whole state of a run after a generation, as one file.
//!
//! The container is `magic (8 bytes) | version (u32) | length of the payload (u64) | CRC-32 of the payload (u32)
//! | payload`, little-endian. The payload is the length (u64) and text of a JSON object (fingerprints, the log,
//! the hall of fame) followed by the population: each member's trees in preorder, a byte a node (its position
//! in the list of names in the JSON object; constants are followed by their 4 bytes), and what it solves.
//!
//! Reading checks everything before it believes it: a file that is cut, changed, of another version, of other
//! settings or of other data is an error with a remedy, never a panic and never a wrong run. So is one whose checksum is
//! right and whose parts contradict one another.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::consistency::{self, Contradiction};
use super::fitness::{CaseBits, share};
use super::hall_of_fame::{Entry, EntryLine, HallOfFame};
use super::population::{Genotype, Member, Outcome};
use super::record::Record;
use super::validation::Verdicts;
use crate::support::durable::FileError;
use crate::support::printable::ShownPath as _;
use crate::tree::{Individual, Node, NodeType, Tree, TreeIndex};

const MAGIC: [u8; 8] = *b"VSONARCP";
const HEADER: usize = 8 + 4 + 8 + 4;

/// The version of the format that this program writes and reads.
pub const VERSION: u32 = 1;

/// The state of a run after a complete generation.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// The population of the last complete generation.
    pub population: Vec<Member>,
    /// A record of each generation so far, the initial one first.
    pub records: Vec<Record>,
    /// The best individuals so far.
    pub hall_of_fame: HallOfFame,
}

impl State {
    /// The state without what differs from run to run: two runs with the same settings, seed and data are
    /// equal in it after every generation.
    pub fn without_timing(&self) -> State {
        State { records: self.records.iter().map(Record::without_timing).collect(), ..self.clone() }
    }
}

/// What a checkpoint belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Origin {
    /// Fingerprint of the settings.
    pub settings: u64,
    /// Fingerprint of the training data.
    pub data: u64,
}

/// Why a checkpoint cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// It could not be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// It does not begin like a checkpoint.
    #[error("{}: this is not a checkpoint; start the run again in a new folder", .0.shown())]
    Magic(PathBuf),
    /// It was written in another version of the format.
    #[error(
        "{}: the checkpoint has version {found}, this program reads version {VERSION}; resume with the release that wrote it, or start the run again", path.shown()
    )]
    Version {
        /// The file.
        path: PathBuf,
        /// Its version.
        found: u32,
    },
    /// It is shorter or longer than it says.
    #[error(
        "{}: the checkpoint is cut or was added to ({found} bytes, it should have {expected}); put back a copy of the file, or start the run again in a new folder", path.shown()
    )]
    Length {
        /// The file.
        path: PathBuf,
        /// Bytes it has.
        found: u64,
        /// Bytes it should have.
        expected: u64,
    },
    /// Its checksum does not fit its content, or the content makes no sense.
    #[error(
        "{}: the checkpoint is damaged ({fault}); put back a copy of the file, or start the run again in a new folder", path.shown()
    )]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        fault: String,
    },
    /// What it says does not fit together, or does not fit the settings or the data of the run.
    #[error(
        "{}: the checkpoint contradicts itself or its run ({fault}); put back a copy of the file, or start the run again \
         in a new folder", path.shown()
    )]
    Contradiction {
        /// The file.
        path: PathBuf,
        /// What does not fit.
        fault: Contradiction,
    },
    /// It belongs to other training data.
    #[error(
        "{}: the checkpoint was made with other training data; resume with the data named in the run folder's settings.toml, unchanged", .0.shown()
    )]
    OtherData(PathBuf),
    /// It belongs to other settings.
    #[error(
        "{}: the settings.toml beside the checkpoint is not the one it was made with; undo the change, or start a new run with it (`--settings`)", .0.shown()
    )]
    OtherSettings(PathBuf),
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Meta {
    settings: u64,
    data: u64,
    cases: usize,
    members: usize,
    nodes: Vec<String>,
    records: Vec<Record>,
    hall_of_fame: Vec<EntryLine>,
}

/// The checkpoint of a state as bytes.
pub fn encode(state: &State, origin: Origin) -> Vec<u8> {
    let cases = state.population.first().map_or(0, |m| m.outcome.solved.len());
    let meta = Meta {
        settings: origin.settings,
        data: origin.data,
        cases,
        members: state.population.len(),
        nodes: NodeType::all().map(|t| t.name().to_string()).collect(),
        records: state.records.clone(),
        hall_of_fame: state.hall_of_fame.lines(cases as u32, Verdicts::NONE),
    };
    // Structs of numbers and strings always have a JSON form.
    let meta = serde_json::to_vec(&meta).unwrap_or_default();
    let mut out = vec![0; HEADER];
    out.extend((meta.len() as u64).to_le_bytes());
    out.extend(meta);
    for member in &state.population {
        put_individual(&mut out, member.individual());
        out.push(u8::from(member.outcome.constant));
        out.extend(member.outcome.behaviour.to_le_bytes());
        out.extend(member.outcome.solved.words().iter().flat_map(|w| w.to_le_bytes()));
    }
    let length = (out.len() - HEADER) as u64;
    let checksum = crc32fast::hash(&out[HEADER..]);
    let header =
        [&MAGIC[..], &VERSION.to_le_bytes(), &length.to_le_bytes(), &checksum.to_le_bytes()].concat();
    out[..HEADER].copy_from_slice(&header);
    out
}

fn put_individual(out: &mut Vec<u8>, individual: &Individual) {
    out.push(individual.trees().count() as u8);
    for tree in individual.trees() {
        out.extend((tree.len() as u32).to_le_bytes());
        for node in tree.nodes() {
            out.push(node.node_type().index() as u8);
            if let Node::Constant(value) = node {
                out.extend(value.to_bits().to_le_bytes());
            }
        }
    }
}

/// The state in a checkpoint's bytes; `path` names the file in errors.
///
/// # Errors
/// If the bytes are not a whole, undamaged checkpoint of this version and this origin.
pub fn decode(bytes: &[u8], origin: Origin, path: &Path) -> Result<State, CheckpointError> {
    let file = || path.to_path_buf();
    let damaged = |fault: String| CheckpointError::Damaged { path: file(), fault };
    let mut header = Reader { rest: bytes };
    let magic = header.take(8).unwrap_or(bytes);
    if magic.is_empty() || !MAGIC.starts_with(magic) {
        return Err(CheckpointError::Magic(file()));
    }
    let cut = |expected: u64| CheckpointError::Length { path: file(), found: bytes.len() as u64, expected };
    let found = header.u32().ok_or_else(|| cut(HEADER as u64))?;
    if found != VERSION {
        return Err(CheckpointError::Version { path: file(), found });
    }
    let (Some(length), Some(checksum)) = (header.u64(), header.u32()) else { return Err(cut(HEADER as u64)) };
    if header.rest.len() as u64 != length {
        return Err(cut(length.saturating_add(HEADER as u64)));
    }
    if crc32fast::hash(header.rest) != checksum {
        return Err(damaged("its checksum does not fit its content".to_string()));
    }
    let mut reader = Reader { rest: header.rest };
    let meta = reader.u64().and_then(|n| reader.take(usize::try_from(n).ok()?));
    let meta: Meta = serde_json::from_slice(meta.unwrap_or_default()).map_err(|e| damaged(e.to_string()))?;
    if meta.data != origin.data {
        return Err(CheckpointError::OtherData(file()));
    }
    if meta.settings != origin.settings {
        return Err(CheckpointError::OtherSettings(file()));
    }
    let types: Option<Vec<NodeType>> = meta.nodes.iter().map(|name| NodeType::from_name(name)).collect();
    let types = types.ok_or_else(|| damaged("it has node types this program does not know".to_string()))?;
    let mut population = Vec::new();
    for i in 0..meta.members {
        let member = reader.member(&types, meta.cases);
        population.push(member.ok_or_else(|| damaged(format!("individual {i} makes no sense")))?);
    }
    if !reader.rest.is_empty() || population.is_empty() || meta.records.is_empty() {
        return Err(damaged("its parts do not fit together".to_string()));
    }
    let hall_of_fame = hall(&meta.hall_of_fame, meta.cases).map_err(damaged)?;
    let state = State { population, records: meta.records, hall_of_fame };
    consistency::check(&state).map_err(|fault| CheckpointError::Contradiction { path: file(), fault })?;
    Ok(state)
}

/// The hall of fame of these lines, the best of which comes first, for so many cases.
fn hall(lines: &[EntryLine], cases: usize) -> Result<HallOfFame, String> {
    let mut entries = Vec::new();
    for line in lines.iter().rev() {
        let individual: Individual = line.program.parse().map_err(|e| format!("its hall of fame: {e}"))?;
        if individual.len() != line.nodes {
            return Err(format!("its hall of fame: {} nodes, said to be {}", individual.len(), line.nodes));
        }
        if line.fitness != share(line.correct, cases as u32) {
            return Err(format!(
                "its hall of fame: fitness {} for {} of {cases} cases",
                line.fitness, line.correct
            ));
        }
        entries.push(Entry { individual, correct: line.correct, generation: line.generation });
    }
    HallOfFame::from_entries(entries).ok_or_else(|| "its hall of fame is in disorder".to_string())
}

/// Takes numbers from bytes; `None` at their end.
struct Reader<'a> {
    rest: &'a [u8],
}

impl<'a> Reader<'a> {
    fn take(&mut self, n: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.rest.split_at_checked(n)?;
        self.rest = rest;
        Some(taken)
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.take(N)?.try_into().ok()
    }

    fn byte(&mut self) -> Option<u8> {
        self.array::<1>().map(|[byte]| byte)
    }

    fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Option<u64> {
        self.array().map(u64::from_le_bytes)
    }

    fn tree(&mut self, types: &[NodeType], which: TreeIndex) -> Option<Tree> {
        let len = self.u32()? as usize;
        let mut nodes = Vec::with_capacity(len.min(self.rest.len()));
        for _ in 0..len {
            nodes.push(match types.get(usize::from(self.byte()?))?.node() {
                Node::Constant(_) => Node::Constant(f32::from_bits(self.u32()?)),
                node => node,
            });
        }
        Tree::from_nodes(nodes, which).ok()
    }

    fn individual(&mut self, types: &[NodeType]) -> Option<Individual> {
        let first = match self.byte()? {
            1 => None,
            2 => Some(self.tree(types, TreeIndex::First)?),
            _ => return None,
        };
        let second = self.tree(types, TreeIndex::Second)?;
        Individual::new(first, second).ok()
    }

    fn member(&mut self, types: &[NodeType], cases: usize) -> Option<Member> {
        let genotype = Genotype::new(self.individual(types)?);
        let constant = match self.byte()? {
            0 => false,
            1 => true,
            _ => return None,
        };
        let behaviour = self.u64()?;
        let words = self.take(cases.div_ceil(64).checked_mul(8)?)?;
        let words: Vec<u64> =
            words.chunks_exact(8).filter_map(|w| Some(u64::from_le_bytes(w.try_into().ok()?))).collect();
        let solved = CaseBits::from_words(&words, cases)?;
        Some(Member { genotype, outcome: Outcome { solved, behaviour, constant } })
    }
}
