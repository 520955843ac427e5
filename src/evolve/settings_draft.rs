//! Settings put together from several sources, checked once they are all there.

use std::collections::BTreeMap;

use toml::Spanned;
use toml::de::DeTable;

use super::settings::{Fault, Given, Preset, Settings, SettingsError};

/// Settings that are still being put together: files and single changes are laid one over the other, and only
/// what they come to is checked. So the order of changes that make sense only together does not matter.
///
/// ```
/// use vsonar::evolve::{Draft, Settings};
///
/// let mut draft = Draft::new(Settings::default_preset());
/// draft.lay_over("[creation]\nmin_depth = 10\n", "deep.toml")?;
/// // by itself, the file is at odds with the preset
/// draft.change("creation.max_depth", |settings| settings.creation.max_depth = 10);
/// assert_eq!(draft.finish()?.creation.min_depth, 10);
/// # Ok::<(), vsonar::evolve::SettingsError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Draft {
    settings: Settings,
    /// Who gave a field last, by dotted name.
    givers: BTreeMap<String, Giver>,
    /// How many sources there were.
    sources: usize,
}

/// Where a field has its value from.
#[derive(Debug, Clone)]
struct Giver {
    /// Its number among the sources.
    source: usize,
    /// File, line and column, if it is a text.
    place: Option<(String, usize, usize)>,
}

impl Draft {
    /// A draft that starts from these settings.
    pub fn new(base: Settings) -> Draft {
        Draft { settings: base, givers: BTreeMap::new(), sources: 0 }
    }

    /// Lays over it what `text` gives. A preset it names replaces everything before.
    ///
    /// # Errors
    /// If the text is not TOML, or a field or node type is unknown or its value of the wrong type; `file` names
    /// the source in messages, here and at the end. The draft is then as it was.
    pub fn lay_over(&mut self, text: &str, file: &str) -> Result<(), SettingsError> {
        let mut settings = self.settings.clone();
        let laid = settings.overlay(text, file)?;
        self.settings = settings;
        self.remember(laid, file);
        Ok(())
    }

    /// The same with a table of a larger text, which has a meaning of its own: `text` is the whole of it, so that
    /// places in messages are those of the file.
    ///
    /// # Errors
    /// As [`Draft::lay_over`].
    pub fn lay_over_table(
        &mut self,
        table: Spanned<DeTable<'_>>,
        text: &str,
        file: &str,
    ) -> Result<(), SettingsError> {
        let mut settings = self.settings.clone();
        let laid = settings.overlay_table(table, text, file)?;
        self.settings = settings;
        self.remember(laid, file);
        Ok(())
    }

    fn remember(&mut self, (given, preset): (Given, Option<Preset>), file: &str) {
        if preset.is_some() {
            self.givers.clear();
        }
        self.sources += 1;
        for (field, (line, column)) in given {
            let place = Some((file.to_string(), line, column));
            self.givers.insert(field, Giver { source: self.sources, place });
        }
    }

    /// Changes a field, or a table of them, that is named here by its dotted name.
    pub fn change<T>(&mut self, field: &str, change: impl FnOnce(&mut Settings) -> T) -> T {
        self.sources += 1;
        self.givers.insert(field.to_string(), Giver { source: self.sources, place: None });
        change(&mut self.settings)
    }

    /// The settings, checked.
    ///
    /// # Errors
    /// The first impossible value. Where two fields do not go together, the place is that of the one given last.
    pub fn finish(self) -> Result<Settings, SettingsError> {
        match self.settings.check() {
            Ok(()) => Ok(self.settings),
            Err(fault) => Err(match self.giver(&fault).and_then(|giver| giver.place.clone()) {
                Some((file, line, column)) => {
                    SettingsError::ValueAt { file, line, column, fault: Box::new(fault) }
                }
                None => SettingsError::Value(Box::new(fault)),
            }),
        }
    }

    /// Who brought a fault about.
    fn giver(&self, fault: &Fault) -> Option<&Giver> {
        let concerned = |name: &str| {
            [Some(fault.field.as_str()), fault.beside].into_iter().flatten().any(|field| overlap(name, field))
        };
        let givers = self.givers.iter().filter(|(name, _)| concerned(name));
        // Of fields given by the same text, the one that the fault names.
        givers.max_by_key(|(name, giver)| (giver.source, **name == fault.field)).map(|(_, giver)| giver)
    }
}

/// Whether two dotted names are one, or one is that of a table which the other is in.
fn overlap(a: &str, b: &str) -> bool {
    let within = |a: &str, b: &str| a.strip_prefix(b).is_some_and(|rest| rest.starts_with('.'));
    a == b || within(a, b) || within(b, a)
}
