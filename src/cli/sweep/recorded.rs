//! What the settings of a sweep were: a file for each in the folder of results.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use vsonar::evolve::Settings;
use vsonar::support::bounded::Bounded;
use vsonar::support::temporary;

use super::super::CliError;
use super::super::output::write_file;
use super::settings::Setting;

/// The folder of the files, in that of the results.
pub(crate) const FOLDER: &str = "settings";

/// Reads the settings recorded.
const SETTING: Bounded = Bounded::to(16 << 20);

/// Differences that are told; of more there are no words.
const TOLD: usize = 5;

/// Records settings, but for those that are recorded already.
pub(crate) fn write<'a>(
    results: &Path,
    settings: impl IntoIterator<Item = &'a Setting>,
) -> Result<(), CliError> {
    let folder = results.join(FOLDER);
    fs::create_dir_all(&folder).map_err(|e| CliError::file(&folder, "make the folder", &e))?;
    temporary::clear_in(&folder, |name| name.ends_with(".toml"));
    for setting in settings {
        let (path, text) = (path(results, &setting.name), text(setting));
        if SETTING.bytes(&path).ok().as_deref() != Some(text.as_bytes()) {
            write_file(&path, text.as_bytes())?;
        }
    }
    Ok(())
}

/// How a setting differs from what is recorded of it, field by field; empty if nothing is known.
pub(crate) fn differences(results: &Path, setting: &Setting) -> Vec<String> {
    let recorded = SETTING.text(&path(results, &setting.name)).ok();
    let Some(then) = recorded.and_then(|text| text.parse::<toml::Table>().ok()) else { return vec![] };
    let Ok(now) = text(setting).parse::<toml::Table>() else { return vec![] };
    let (then, now) = (flat("", &then), flat("", &now));
    let keys: BTreeSet<&String> = then.iter().chain(&now).map(|(key, _)| key).collect();
    let of = |fields: &[(String, String)], key: &str| {
        let field = fields.iter().find(|(name, _)| name == key);
        field.map_or_else(|| "not there".to_string(), |(_, value)| value.clone())
    };
    let told = keys.into_iter().map(|key| (key, of(&then, key), of(&now, key)));
    let told = told.filter(|(_, then, now)| then != now).take(TOLD);
    told.map(|(key, then, now)| format!("`{key}` was {then}, now {now}")).collect()
}

fn text(setting: &Setting) -> String {
    let settings = Settings { seed: 0, ..setting.settings.clone() };
    format!(
        "# The setting `{}` of a sweep; the seed is that of each run.\n\n{}",
        setting.name,
        settings.to_toml()
    )
}

/// The fields with their values, those of tables below them by dotted keys.
fn flat(prefix: &str, table: &toml::Table) -> Vec<(String, String)> {
    let field = |(key, value): (&String, &toml::Value)| match value {
        toml::Value::Table(inner) => flat(&format!("{prefix}{key}."), inner),
        value => vec![(format!("{prefix}{key}"), value.to_string())],
    };
    table.iter().flat_map(field).collect()
}

/// The file of a setting: its name, and a number that tells names apart that are no names of files.
fn path(results: &Path, name: &str) -> PathBuf {
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || "-_=.".contains(c);
    let text: String = name.chars().take(80).map(|c| if plain(c) { c } else { '_' }).collect();
    let leaf = if text == name && !name.starts_with('.') {
        format!("{text}.toml")
    } else {
        // FNV-1a.
        let hash = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3);
        format!("{text}-{:016x}.toml", name.bytes().fold(0xcbf2_9ce4_8422_2325, hash))
    };
    results.join(FOLDER).join(leaf)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn setting(name: &str, settings: Settings) -> Setting {
        Setting { name: name.into(), base: name.into(), settings }
    }

    #[test]
    fn names_of_files_are_distinct_and_stay_in_the_folder() {
        let names =
            ["a", "A", "a b", "a/b", "../a", ".", "..", "a, selection.tournament=3", "\u{e9}", "\u{e8}"];
        let long = ["x".repeat(300), "x".repeat(301)];
        let names: Vec<&str> = names.into_iter().chain(long.iter().map(String::as_str)).collect();
        let paths: BTreeSet<String> =
            names.iter().map(|name| path(Path::new("r"), name).to_string_lossy().to_lowercase()).collect();
        assert_eq!(paths.len(), names.len(), "{paths:?}");
        for path in &paths {
            let leaf = path.strip_prefix("r/settings/").expect("in the folder");
            assert!(!leaf.contains('/') && leaf.len() < 128 && leaf.ends_with(".toml"), "{leaf}");
        }
        assert!(paths.contains("r/settings/a.toml"));
    }

    #[test]
    fn what_was_changed_is_told() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let then = setting("a b", Settings::default_preset());
        assert!(differences(dir.path(), &then).is_empty(), "nothing is known");
        write(dir.path(), [&then]).expect("writable");
        let mut now = Settings { seed: 7, ..Settings::default_preset() };
        assert!(differences(dir.path(), &setting("a b", now.clone())).is_empty(), "the seed is none");
        now.selection.tournament += 1;
        let tournament = now.selection.tournament;
        assert_eq!(
            differences(dir.path(), &setting("a b", now.clone())),
            [format!("`selection.tournament` was {}, now {tournament}", tournament - 1)]
        );
        assert!(differences(dir.path(), &setting("another", now)).is_empty());
        assert_eq!(differences(dir.path(), &setting("a b", Settings::paper())).len(), TOLD);
    }
}
