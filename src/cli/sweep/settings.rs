//! The settings of a sweep, as its file lists them: `[settings]` for all, `[[setting]]` one by one, and `[grid]`.

use std::collections::{BTreeSet, HashMap};

use serde::Deserialize;
use toml::Spanned;
use toml::de::{DeTable, DeValue, ValueDeserializer};
use vsonar::evolve::{Draft, Preset, Settings, SettingsError};
use vsonar::tree::Creator;

use super::super::CliError;
use super::super::output::grouped;
use super::super::settings::nested;
use super::row::settings_fingerprint;
use super::spec::{File, checked_name};

/// The most settings of a sweep, all points of the grid counted.
const MOST: usize = 10_000;

/// Settings under their name.
#[derive(Debug, Clone)]
pub(crate) struct Setting {
    pub(crate) name: String,
    /// The name without what the grid adds.
    pub(crate) base: String,
    /// With a seed of no meaning.
    pub(crate) settings: Settings,
}

/// What a table of settings has beside settings.
#[derive(Default)]
struct Heading {
    name: Option<Spanned<String>>,
    preset: Option<Preset>,
    nodes: Option<Spanned<String>>,
}

/// An axis of the grid: a field, where it stands, and its values.
struct Axis {
    key: String,
    at: usize,
    values: Vec<toml::Value>,
}

/// All settings: those listed, each at every point of the grid.
pub(crate) fn all(
    file: &File<'_>,
    root: &DeTable<'_>,
    preset: Option<Preset>,
) -> Result<Vec<Setting>, CliError> {
    let common = match root.get("settings") {
        None => None,
        Some(value) => Some(table(file, value, "[settings]")?),
    };
    let listed = match root.get("setting").map(|value| (value.get_ref(), value.span().start)) {
        None => vec![],
        Some((DeValue::Array(array), _)) => {
            array.iter().map(|value| table(file, value, "[[setting]]")).collect::<Result<_, _>>()?
        }
        Some((_, at)) => {
            return Err(file.fault(at, "settings are listed in tables [[setting]], each with a name"));
        }
    };
    let axes = match root.get("grid") {
        None => vec![],
        Some(value) => axes(file, table(file, value, "[grid]")?)?,
    };
    let points = axes.iter().try_fold(1usize, |points, axis| points.checked_mul(axis.values.len()));
    let within = |points: &usize| points.checked_mul(listed.len().max(1)).is_some_and(|all| all <= MOST);
    let Some(points) = points.filter(within) else {
        let at = axes.first().map_or(0, |axis| axis.at);
        let text = format!(
            "the settings at all points of the grid are more than {}; take values or axes out",
            grouped(MOST as u64)
        );
        return Err(file.fault(at, text));
    };
    let mut names = BTreeSet::new();
    let mut known = HashMap::new();
    let mut all = Vec::new();
    let mut add = |heading: Heading, own: Option<Spanned<DeTable<'_>>>, at: usize| -> Result<(), CliError> {
        let preset = heading.preset.or(preset).unwrap_or(Preset::Default);
        let base = match &heading.name {
            Some(name) => checked_name(file, name)?,
            None => format!("{preset:?}").to_lowercase(),
        };
        let mut draft = Draft::new(Settings::preset(preset));
        for table in common.iter().cloned().chain(own) {
            draft.lay_over_table(table, file.text, &file.name)?;
        }
        if let Some(edits) = &heading.nodes {
            let edited = draft.change("nodes", |settings| settings.nodes.edit(edits.get_ref()));
            edited.map_err(|e| file.fault(edits.span().start, e))?;
        }
        for point in 0..points {
            let (mut draft, mut name, mut rest) = (draft.clone(), base.clone(), point);
            // The last axis is the fastest.
            let stride = |i: usize| axes[i + 1..].iter().map(|axis| axis.values.len()).product::<usize>();
            for (i, axis) in axes.iter().enumerate() {
                let value = &axis.values[rest / stride(i)];
                rest %= stride(i);
                name += &format!(
                    ", {}={}",
                    axis.key,
                    value.as_str().map_or_else(|| value.to_string(), str::to_string)
                );
                let place = file.place(axis.at);
                let laid = draft.lay_over(&nested(&axis.key, value.clone()).to_string(), &place);
                laid.map_err(|error| at_place(&place, error))?;
            }
            let settings = draft.finish().map_err(|error| match error {
                SettingsError::ValueAt { file: giver, fault, .. } if giver != file.name => {
                    CliError::Failed(format!("{giver}: {fault}"))
                }
                SettingsError::ValueAt { .. } => error.into(),
                other => file.fault(at, other),
            })?;
            if let Err(error) = Creator::new(&settings.create_settings()) {
                return Err(file.fault(at, format!("with the setting `{name}`: {error}")));
            }
            if !names.insert(name.clone()) {
                return Err(file.fault(at, format!("there are two settings `{name}`; rename one")));
            }
            let fingerprint = settings_fingerprint(&Settings { seed: 0, ..settings.clone() });
            if let Some(other) = known.insert(fingerprint, name.clone()) {
                return Err(
                    file.fault(at, format!("`{other}` and `{name}` are the same settings; take one out"))
                );
            }
            all.push(Setting { name, base: base.clone(), settings });
        }
        Ok(())
    };
    if let Some(common) = &common
        && let Some((key, _)) = common.get_ref().get_key_value("preset")
    {
        return Err(file
            .fault(key.span().start, "the preset for all settings stands above the tables: `preset = ...`"));
    }
    if listed.is_empty() {
        add(Heading::default(), None, 0)?;
    }
    for own in listed {
        let at = own.span().start;
        let (heading, own) = heading(file, own)?;
        if heading.name.is_none() {
            return Err(file.fault(at, "this setting has no name; give it one: `name = ...`"));
        }
        add(heading, Some(own), at)?;
    }
    Ok(all)
}

/// What is wrong with a text that stands at this place.
fn at_place(place: &str, error: SettingsError) -> CliError {
    CliError::Failed(match error {
        SettingsError::Syntax { message, .. } => {
            format!(
                "{place}: {message}; every field with its meaning stands in the settings.toml of a run folder"
            )
        }
        SettingsError::ValueAt { fault, .. } | SettingsError::Value(fault) => format!("{place}: {fault}"),
        other => other.to_string(),
    })
}

/// A value that is to be a table, without the fields that are no settings of a sweep.
fn table<'a>(
    file: &File<'_>,
    value: &Spanned<DeValue<'a>>,
    what: &str,
) -> Result<Spanned<DeTable<'a>>, CliError> {
    let DeValue::Table(table) = value.get_ref() else {
        return Err(file.fault(value.span().start, format!("{what} is a table")));
    };
    for (key, remedy) in [
        ("seed", "seeds are listed above the tables: `seeds = \"1-10\"`"),
        ("data", "data sets are listed in tables [[data]]"),
    ] {
        if let Some((key, _)) = table.get_key_value(key) {
            return Err(file
                .fault(key.span().start, format!("`{}` is no setting of a sweep; {remedy}", key.get_ref())));
        }
    }
    Ok(Spanned::new(value.span(), table.clone()))
}

/// Takes out of a table [[setting]] what is no setting.
fn heading<'a>(
    file: &File<'_>,
    own: Spanned<DeTable<'a>>,
) -> Result<(Heading, Spanned<DeTable<'a>>), CliError> {
    let span = own.span();
    let mut own = own.into_inner();
    fn take<'a, T: Deserialize<'a>>(
        file: &File<'_>,
        own: &mut DeTable<'a>,
        key: &str,
    ) -> Result<Option<T>, CliError> {
        let value = own.remove(key).map(|value| T::deserialize(ValueDeserializer::from(value)));
        value.transpose().map_err(|error| file.toml(&error))
    }
    let heading = Heading {
        name: take(file, &mut own, "name")?,
        preset: take(file, &mut own, "preset")?,
        nodes: take(file, &mut own, "edit_nodes")?,
    };
    Ok((heading, Spanned::new(span, own)))
}

/// The axes of the grid, in the order of the file.
fn axes(file: &File<'_>, grid: Spanned<DeTable<'_>>) -> Result<Vec<Axis>, CliError> {
    fn collect(
        file: &File<'_>,
        prefix: &str,
        table: &DeTable<'_>,
        axes: &mut Vec<Axis>,
    ) -> Result<(), CliError> {
        for (key, value) in table {
            let (at, name) = (key.span().start, format!("{prefix}{}", key.get_ref()));
            match value.get_ref() {
                DeValue::Table(inner) => collect(file, &format!("{name}."), inner, axes)?,
                DeValue::Array(array) if !array.is_empty() => {
                    let value = |v: &Spanned<DeValue<'_>>| {
                        toml::Value::deserialize(ValueDeserializer::from(v.clone()))
                    };
                    let values: Result<Vec<_>, _> = array.iter().map(value).collect();
                    axes.push(Axis { key: name, at, values: values.map_err(|e| file.toml(&e))? });
                }
                _ => {
                    let text = format!("an axis of the grid is a list of values: `\"{name}\" = [...]`");
                    return Err(file.fault(at, text));
                }
            }
        }
        Ok(())
    }
    let mut axes = Vec::new();
    collect(file, "", grid.get_ref(), &mut axes)?;
    axes.sort_by_key(|axis| axis.at);
    let mut keys = BTreeSet::new();
    for axis in &axes {
        if !keys.insert(&axis.key) {
            let text = format!("`{}` is an axis already; put all its values into one list", axis.key);
            return Err(file.fault(axis.at, text));
        }
        if matches!(axis.key.as_str(), "seed" | "preset" | "name" | "data" | "edit_nodes") {
            let text = format!(
                "`{}` is no setting; seeds, presets and data sets have places of their own",
                axis.key
            );
            return Err(file.fault(axis.at, text));
        }
    }
    Ok(axes)
}
