use super::*;
use std::fs;

fn folder(images: &[&str]) -> tempfile::TempDir {
    let dir = tempfile::tempdir().expect("a temporary folder");
    for name in images {
        let path = dir.path().join(name);
        fs::create_dir_all(path.parent().expect("below")).expect("writable");
        GrayImage::new(40, 30).save(path).expect("writable");
    }
    dir
}

fn change(image: &str, x: u32, from: Option<Mark>, to: Option<Mark>) -> Vec<Change> {
    vec![Change { image: image.into(), x, from, also: vec![], to }]
}

#[test]
fn images_are_in_order_and_others_are_named() {
    let dir =
        folder(&["f10.png", "f9.png", "images/f1.png", "images/f9.png", ".hidden.png", "deep/down/a.png"]);
    GrayImage::new(41, 30).save(dir.path().join("f11.png")).expect("writable");
    fs::write(dir.path().join("f12.jpg"), "no image").expect("writable");
    fs::write(dir.path().join("labels.csv"), "image,x,y\ndown/a.png,1,2\ndeep/down/a.png,1,2\n")
        .expect("writable");
    let session = Session::open(dir.path(), &Columns::Spread(2)).expect("sound");
    assert_eq!(session.images().collect::<Vec<_>>(), ["deep/down/a.png", "f1.png", "f9.png", "f10.png"]);
    let left_out: Vec<&str> = session.left_out().iter().map(|file| file.name.as_str()).collect();
    assert_eq!(left_out, ["down/a.png", "f12.jpg", "f11.png"]);
    assert_eq!((session.size(), session.columns()), ((40, 30), &[10, 30][..]));
    assert_eq!(session.progress(), Progress { asked: 8, labels: 0, skipped: 0 });
    assert_eq!((session.labels_in_table(), session.in_subfolders()), (2, None));
}

#[test]
fn an_image_is_one_however_the_files_spell_it() {
    let dir = folder(&["images/a.png", "images/b.png"]);
    let file = |name: &str| dir.path().join(name);
    fs::write(file("labels.csv"), "image,x,y\nimages/a.png,10,5\n./a.png,30,6\nimages\\b.png,10,7\n")
        .expect("writable");
    fs::write(file("labels.skip.csv"), "\"image\";\"x\"\nimages/b.png;30.0\n").expect("writable");
    let session = Session::open(dir.path(), &Columns::Spread(2)).expect("sound");
    assert_eq!(session.images().collect::<Vec<_>>(), ["a.png", "b.png"]);
    assert_eq!(session.progress(), Progress { asked: 4, labels: 3, skipped: 1 });
    let mark = |image, x, from, to| {
        assert!(session.apply(change(image, x, from, to)).expect("writable").refused.is_empty());
    };
    mark("a.png", 30, Some(Mark::Row(6)), Some(Mark::Row(8)));
    mark("b.png", 30, Some(Mark::Skip), Some(Mark::Row(9)));
    assert_eq!(
        fs::read_to_string(file("labels.csv")).expect("there"),
        "image,x,y\nimages/a.png,10,5\n./a.png,30,8\nimages\\b.png,10,7\nimages/b.png,30,9\n"
    );
    assert_eq!(fs::read_to_string(file("labels.skip.csv")).expect("there"), "image,x\n");
    // Another program adds a row that contradicts one of another spelling.
    let table = fs::read_to_string(file("labels.csv")).expect("there");
    fs::write(file("labels.csv"), format!("{table}b.png,10,1\n")).expect("writable");
    let error = session.since(0).expect_err("contradictory").to_string();
    assert!(error.contains("labels.csv line 6") && error.contains("(labels.csv line 4)"), "{error}");
}

#[test]
#[cfg(unix)]
fn a_link_to_an_image_in_the_folder_is_that_image() {
    let dir = folder(&["images/a.png"]);
    std::os::unix::fs::symlink("images/a.png", dir.path().join("b.png")).expect("writable");
    fs::write(dir.path().join("labels.csv"), "image,x,y\nb.png,10,5\n").expect("writable");
    let session = Session::open(dir.path(), &Columns::Spread(2)).expect("sound");
    assert_eq!(session.images().collect::<Vec<_>>(), ["a.png"]);
    assert_eq!(session.progress(), Progress { asked: 2, labels: 1, skipped: 0 });
}

#[test]
fn columns_are_those_of_the_table_unless_given() {
    let dir = folder(&["a.png", "b.png", "c.png"]);
    let columns = |columns: Columns| Session::open(dir.path(), &columns).map(|s| s.columns().to_vec());
    assert_eq!(columns(Columns::AsBefore(4)).expect("sound"), [5, 15, 25, 35]);
    fs::write(dir.path().join("labels.csv"), "image,x,y\na.png,7,2\na.png,9,2\nb.png,7,1\nc.png,3,1\n")
        .expect("writable");
    assert_eq!(columns(Columns::AsBefore(4)).expect("sound"), [7]);
    assert_eq!(columns(Columns::These(vec![9, 3])).expect("sound"), [3, 9]);
    // Those last asked for are kept, and are not lost to what is no list.
    assert_eq!(columns(Columns::AsBefore(4)).expect("sound"), [3, 9]);
    for (kept, expected) in [("", [7]), ("7,x", [7]), ("7,40", [7]), (" 8\n", [8])] {
        fs::write(dir.path().join(".labels.columns"), kept).expect("writable");
        assert_eq!(columns(Columns::AsBefore(4)).expect("sound"), expected, "{kept:?}");
    }
    for wrong in
        [Columns::Spread(41), Columns::Spread(0), Columns::These(vec![40]), Columns::These(vec![9, 3, 9])]
    {
        assert!(matches!(columns(wrong.clone()), Err(SessionError::Columns(_))), "{wrong:?}");
    }
}

#[test]
fn threads_and_sessions_keep_each_others_marks() {
    let names: Vec<String> = (0..4).map(|i| format!("{i}.png")).collect();
    let dir = folder(&names.iter().map(String::as_str).collect::<Vec<_>>());
    let open = || Session::open(dir.path(), &Columns::Spread(4)).expect("sound");
    let sessions = [open(), open()];
    std::thread::scope(|scope| {
        for (i, name) in names.iter().enumerate() {
            let session = &sessions[i % 2];
            scope.spawn(move || {
                for &x in session.columns() {
                    for row in 0..4u32 {
                        let from = row.checked_sub(1).map(Mark::Row);
                        let applied = session.apply(change(name, x, from, Some(Mark::Row(row))));
                        assert!(applied.expect("writable").refused.is_empty());
                    }
                }
            });
        }
    });
    for session in &sessions {
        let (_, cells) = session.since(0).expect("readable");
        assert_eq!(cells.len(), 16);
        assert!(cells.iter().all(|cell| cell.mark == Some(Mark::Row(3))), "{cells:?}");
    }
    let set = crate::dataset::Dataset::load(dir.path()).expect("sound");
    assert_eq!((set.cases().len(), set.labels()), (16, vec![3; 16]));
}

#[test]
fn a_change_that_has_not_seen_the_last_one_is_refused() {
    let dir = folder(&["a.png"]);
    let session = Session::open(dir.path(), &Columns::Spread(1)).expect("sound");
    let apply = |from, to| session.apply(change("a.png", 20, from, to)).expect("writable").refused;
    let (five, six) = (Some(Mark::Row(5)), Some(Mark::Row(6)));
    assert_eq!(apply(None, five), []);
    assert_eq!(apply(None, six), [Cell { image: "a.png".into(), x: 20, mark: five }]);
    // The same again, as when the answer was lost.
    assert_eq!(apply(None, five), []);
    assert_eq!(apply(five, Some(Mark::Skip)), []);
    assert_eq!(session.progress(), Progress { asked: 1, labels: 0, skipped: 1 });
    assert_eq!(apply(five, None), [Cell { image: "a.png".into(), x: 20, mark: Some(Mark::Skip) }]);
    assert_eq!(apply(Some(Mark::Skip), None), []);
    let (revision, cells) = session.since(1).expect("readable");
    assert_eq!(cells, [Cell { image: "a.png".into(), x: 20, mark: None }]);
    assert_eq!(session.since(revision).expect("readable"), (revision, vec![]));
    assert!(session.fault(&change("a.png", 20, None, Some(Mark::Row(30)))[0]).is_some());
    assert!(session.fault(&change("a.png", 20, None, Some(Mark::Row(29)))[0]).is_none());
}

#[test]
fn the_first_mark_does_not_choose_the_columns() {
    let dir = folder(&["a.png", "b.png"]);
    let open = || Session::open(dir.path(), &Columns::AsBefore(4)).expect("sound");
    assert!(open().apply(change("a.png", 5, None, Some(Mark::Row(5)))).expect("writable").refused.is_empty());
    assert_eq!(open().columns(), [5, 15, 25, 35]);
}

#[test]
fn a_mark_whose_answer_was_lost_is_ones_own() {
    let dir = folder(&["a.png"]);
    let session = Session::open(dir.path(), &Columns::Spread(1)).expect("sound");
    let apply = |from, also: &[Option<Mark>], to| {
        let change = Change { image: "a.png".into(), x: 20, from, also: also.to_vec(), to };
        session.apply(vec![change]).expect("writable").refused.len()
    };
    let [five, six, seven] = [5, 6, 7].map(|row| Some(Mark::Row(row)));
    assert_eq!(apply(None, &[], five), 0);
    // Moved, and taken back, without knowing of the first one.
    assert_eq!(apply(None, &[five], six), 0);
    assert_eq!(apply(None, &[five, six], None), 0);
    assert_eq!(session.progress().labels, 0);
    // The first one never arrived.
    assert_eq!(apply(None, &[five], six), 0);
    // Somebody else's is another one.
    assert_eq!(apply(None, &[five], seven), 1);
    assert_eq!(apply(None, &[five], None), 1);
}

#[test]
fn a_lock_that_another_program_keeps_ends_in_an_error() {
    let dir = folder(&["a.png"]);
    let session = Session::open(dir.path(), &Columns::Spread(1)).expect("sound");
    let path = dir.path().join(".labels.lock");
    let held = fs::File::create(&path).expect("writable");
    held.lock().expect("free");
    std::thread::scope(|scope| {
        let waiting = scope.spawn(|| session.apply(change("a.png", 20, None, Some(Mark::Row(5)))));
        std::thread::sleep(std::time::Duration::from_millis(100));
        // Nothing else waits for it.
        assert_eq!(session.progress().labels, 0);
        assert_eq!(session.since(0).expect("readable").1, []);
        assert!(!waiting.is_finished());
        let error = waiting.join().expect("no panic").expect_err("locked").to_string();
        assert!(error.contains(".labels.lock: another program has locked"), "{error}");
    });
    drop(held);
    session.apply(change("a.png", 20, None, Some(Mark::Row(5)))).expect("free again");
}

#[cfg(unix)]
#[test]
fn a_table_keeps_its_permissions_and_a_read_only_one_its_content() {
    use std::os::unix::fs::PermissionsExt;
    let dir = folder(&["a.png"]);
    let table = dir.path().join("labels.csv");
    fs::write(&table, "image,x,y\n").expect("writable");
    let allow = |mode| fs::set_permissions(&table, fs::Permissions::from_mode(mode)).expect("ours");
    allow(0o600);
    let session = Session::open(dir.path(), &Columns::Spread(1)).expect("sound");
    session.apply(change("a.png", 20, None, Some(Mark::Row(5)))).expect("writable");
    let mode = || fs::metadata(&table).expect("there").permissions().mode() & 0o777;
    assert_eq!(mode(), 0o600);
    allow(0o444);
    let refused = session.apply(change("a.png", 20, Some(Mark::Row(5)), Some(Mark::Row(6))));
    let error = refused.expect_err("read-only").to_string();
    assert!(error.contains("labels.csv: is read-only; make the file writable"), "{error}");
    assert_eq!((mode(), session.progress().labels), (0o444, 1));
    assert_eq!(fs::read_to_string(&table).expect("there"), "image,x,y\na.png,20,5\n");
}

#[test]
fn an_image_that_is_replaced_is_not_shown() {
    let dir = folder(&["a.png"]);
    let session = Session::open(dir.path(), &Columns::Spread(1)).expect("sound");
    session.png(0).expect("shown");
    GrayImage::new(20, 18).save(dir.path().join("a.png")).expect("writable");
    let error = session.png(0).expect_err("another size").to_string();
    assert!(error.contains("has 20x18 pixels now, not 40x30"), "{error}");
}

#[test]
fn a_failure_to_write_changes_nothing() {
    let dir = folder(&["a.png"]);
    let session = Session::open(dir.path(), &Columns::Spread(1)).expect("sound");
    for (name, mark, text) in
        [("labels.csv", Mark::Row(5), "image,x,y\n"), ("labels.skip.csv", Mark::Skip, "image,x\n")]
    {
        let path = dir.path().join(name);
        fs::write(&path, text).expect("writable");
        let mut permissions = path.metadata().expect("there").permissions();
        permissions.set_readonly(true);
        fs::set_permissions(&path, permissions).expect("ours");
        let error = session.apply(change("a.png", 20, None, Some(mark))).expect_err("read-only").to_string();
        assert!(error.contains(name) && error.contains("is read-only"), "{error}");
        assert_eq!(session.progress(), Progress { asked: 1, labels: 0, skipped: 0 });
        // So it is said before there is anything to be lost.
        let error = Session::open(dir.path(), &Columns::Spread(1)).expect_err("read-only").to_string();
        assert!(error.contains(name) && error.contains("is read-only"), "{error}");
        fs::remove_file(&path).expect("there");
    }
    assert_eq!(session.apply(change("a.png", 20, None, Some(Mark::Skip))).expect("writable").refused, []);
}

#[test]
fn differences_are_found_on_both_sides() {
    let marks = |cells: &[(&str, u32)]| -> Marks {
        cells.iter().map(|&(image, row)| ((image.to_string(), 1), Mark::Row(row))).collect()
    };
    let images = |before: &[(&str, u32)], after: &[(&str, u32)]| -> String {
        differences(&marks(before), &marks(after)).into_iter().map(|(image, _)| image).collect()
    };
    assert_eq!(images(&[("a", 1), ("c", 2), ("d", 3)], &[("b", 1), ("c", 2), ("d", 4), ("e", 5)]), "abde");
    assert_eq!(images(&[], &[("a", 1)]), "a");
    assert_eq!(images(&[("a", 1)], &[]), "a");
    assert_eq!(images(&[("a", 1)], &[("a", 1)]), "");
}
