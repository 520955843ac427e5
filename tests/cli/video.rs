//! `vsonar data video`: frames of a video, through the installed ffmpeg or what stands for it.

use std::path::Path;
use std::process::Command;

use image::{GrayImage, Luma};
use vsonar::frames::y4m::{Chroma, Header, Writer};

use crate::common::*;

/// So many frames, ten a second, each brighter than the one before.
fn y4m(frames: u8) -> Vec<u8> {
    let header =
        Header { width: 64, height: 48, rate: "10".parse().ok(), chroma: Chroma::Mono, limited: Some(false) };
    let mut writer = Writer::new(Vec::new(), header).expect("room");
    for i in 0..frames {
        let frame = GrayImage::from_fn(64, 48, |x, _| Luma([4 * i + if x < 32 { 0 } else { 100 }]));
        writer.write_gray(&frame).expect("room");
    }
    writer.into_inner()
}

/// The frames of a folder, by the numbers of those that they were.
fn taken(folder: &Path) -> Vec<u8> {
    let mut names: Vec<_> =
        std::fs::read_dir(folder).expect("there").map(|e| e.expect("readable").path()).collect();
    names.sort();
    for (i, path) in names.iter().enumerate() {
        assert_eq!(path.file_name().expect("a name").to_string_lossy(), format!("frame_{:06}.png", i + 1));
    }
    let number = |path: &std::path::PathBuf| {
        let frame = image::open(path).expect("an image").into_luma8();
        let level = frame.get_pixel(0, 0).0[0];
        assert_eq!((level % 4, frame.get_pixel(frame.width() - 1, 0).0[0]), (0, level + 100), "full range");
        level / 4
    };
    names.iter().map(number).collect()
}

#[test]
fn frames_are_taken_at_even_distances() {
    if !has_ffmpeg() {
        return;
    }
    let place = Place::new();
    place.write("v.y4m", y4m(25));
    // A file with times that are rounded to milliseconds, without loss.
    encode(&place, &[], &["-c:v", "ffv1"], "v.mkv");
    for video in ["v.y4m", "v.mkv"] {
        for (i, (flags, expected)) in [
            (&[][..], vec![0, 10, 20]),
            (&["--every", "1s", "--frames", "2"], vec![0, 10]),
            (&["--every", "10f"], vec![0, 10, 20]),
            (&["--every", "300ms"], vec![0, 3, 6, 9, 12, 15, 18, 21, 24]),
            (&["--fps", "5", "--frames", "4"], vec![0, 2, 4, 6]),
            // More than there are: none is repeated.
            (&["--fps", "60"], (0..25).collect()),
            (&["--start", "1", "--every", "500ms"], vec![10, 15, 20]),
            (&["--start", "0:02.3", "--every", "1f"], vec![23, 24]),
        ]
        .into_iter()
        .enumerate()
        {
            let out = format!("{video}-{i}");
            let said = place.ok(&[&["data", "video", video, "--out", &out], flags].concat());
            assert_eq!(taken(&place.path(&out)), expected, "{video} {flags:?}");
            let (start, end) =
                (format!("{out}: {} frame", expected.len()), format!("Next: vsonar label {out}\n"));
            assert!(said.starts_with(&start) && said.ends_with(&end), "{said}");
        }
    }
    let flags = ["--crop", "16,0,32,32", "--size", "16x16", "--json", "--out", "small"];
    let said = place.ok(&[&["data", "video", "v.mkv"], &flags[..]].concat());
    let said: serde_json::Value = serde_json::from_str(&said).expect("JSON");
    assert_eq!(
        (&said["frames"], &said["width"], &said["height"]),
        (&3.into(), &16.into(), &16.into()),
        "{said}"
    );
    assert_eq!(taken(&place.path("small")), [0, 10, 20]);
}

/// Makes a video of `v.y4m` with the installed ffmpeg.
fn encode(place: &Place, before: &[&str], after: &[&str], name: &str) {
    let mut ffmpeg = Command::new("ffmpeg");
    ffmpeg.args(["-nostdin", "-loglevel", "error"]).args(before).args(["-i", "v.y4m"]).args(after).arg(name);
    assert!(ffmpeg.current_dir(place.path("")).status().expect("it runs").success(), "{name}");
}

#[test]
fn every_frame_comes_once() {
    if !has_ffmpeg() {
        return;
    }
    let place = Place::new();
    place.write("v.y4m", y4m(25));
    let all: Vec<u8> = (0..25).collect();
    let gaps: Vec<u8> = (0..25).filter(|i| i % 7 != 3).collect();
    let ffv1 = ["-c:v", "ffv1"];
    for (name, before, after, frames) in [
        ("r5.mkv", &["-r", "5"][..], &ffv1[..], &all),
        ("r30.mkv", &["-r", "30"], &ffv1, &all),
        ("r29.97.mkv", &["-r", "30000/1001"], &ffv1, &all),
        ("uneven.mkv", &[], &["-vf", "select=not(eq(mod(n\\,7)\\,3))", "-c:v", "ffv1"], &gaps),
        ("slower.mkv", &[], &["-vf", "setpts=N*N/(20*TB)", "-c:v", "ffv1"], &all),
        ("png.avi", &[], &["-c:v", "png", "-pix_fmt", "gray"], &all),
        ("png.mp4", &[], &["-c:v", "png", "-pix_fmt", "gray"], &all),
        ("gray.gif", &[], &["-pix_fmt", "gray"], &all),
        ("gray.apng", &[], &["-pix_fmt", "gray", "-f", "apng"], &all),
    ] {
        encode(&place, before, after, name);
        let out = format!("{name}-frames");
        place.ok(&["data", "video", name, "--every", "1f", "--out", &out]);
        assert_eq!(&taken(&place.path(&out)), frames, "{name}");
        let third: Vec<u8> = frames.iter().copied().step_by(3).collect();
        let out = format!("{name}-third");
        place.ok(&["data", "video", name, "--every", "3f", "--out", &out]);
        assert_eq!(taken(&place.path(&out)), third, "{name}");
    }
    // Frames out of order in the file, and without times of their own: their number counts.
    let b_frames = ["-c:v", "mpeg4", "-bf", "2"];
    encode(&place, &["-r", "5"], &b_frames, "b.avi");
    encode(&place, &[], &["-c:v", "mpeg4", "-f", "m4v"], "raw.m4v");
    for name in ["b.avi", "raw.m4v"] {
        let said = place.ok(&["data", "video", name, "--every", "1f", "--out", &format!("{name}-frames")]);
        assert!(said.contains(": 25 frames of"), "{name}: {said}");
    }
}

/// Films that came out with frames too many.
#[test]
fn films_that_were_repeated() {
    if !has_ffmpeg() {
        return;
    }
    let place = Place::new();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/regressions/video-duplicates");
    for (name, frames) in [("r5.mp4", 10), ("r10.mp4", 20), ("r30.mp4", 60), ("anim.gif", 5)] {
        let film = folder.join(name);
        let out = format!("{name}-frames");
        let film = film.to_str().expect("UTF-8");
        let said = place.ok(&["data", "video", film, "--every", "1f", "--out", &out]);
        assert!(said.starts_with(&format!("{out}: {frames} frames of 64 x 48 pixels")), "{said}");
        let mut pictures: Vec<Vec<u8>> = std::fs::read_dir(place.path(&out))
            .expect("there")
            .map(|entry| std::fs::read(entry.expect("readable").path()).expect("readable"))
            .collect();
        assert_eq!(pictures.len(), frames, "{name}");
        pictures.sort();
        pictures.dedup();
        // The GIF is of one picture alone.
        assert_eq!(pictures.len(), if name == "anim.gif" { 1 } else { frames }, "{name}");
    }
}

#[test]
fn any_name_is_a_file() {
    if !has_ffmpeg() {
        return;
    }
    let place = Place::new();
    for name in ["-y.y4m", "a:b.y4m", "http:x.y4m", "%03d.y4m", "it's; a.y4m", "[x].y4m"] {
        place.write(name, y4m(3));
        place.ok(&["data", "video", "--every", "1f", "--out", "frames", "--", name]);
        assert_eq!(taken(&place.path("frames")), [0, 1, 2], "{name}");
        std::fs::remove_dir_all(place.path("frames")).expect("there");
    }
}

#[test]
fn videos_that_cannot_be_used() {
    let place = Place::new();
    place.write("v.y4m", y4m(3));
    place.write("text.mp4", "no video at all\n");
    place.write("fps_mode-vsync.mp4", "no video either\n");
    for (flags, said) in [
        (&["v.y4m", "--every", "1s", "--fps", "2"][..], "cannot be used with"),
        (&["v.y4m", "--every", "0s"], "above 0"),
        (&["v.y4m", "--start", "-1"], "--start"),
        (&["v.y4m", "--start", "1:60"], "1:02:30"),
        (&["v.y4m", "--frames", "0"], "--frames"),
        (&["v.y4m", "--size", "9x9"], "16 to"),
    ] {
        let complaint = place.fails(2, &[&["data", "video", "--out", "x"], flags].concat());
        assert!(complaint.contains(said), "{flags:?}: {complaint}");
    }
    assert!(place.fails(2, &["data", "video", "v.y4m"]).contains("--out"));
    assert!(place.fails(1, &["data", "video", "v.y4m", "--out", "data"]).contains("never overwritten"));
    assert!(place.fails(1, &["data", "video", "none.mp4", "--out", "x"]).contains("check the path"));
    assert!(place.fails(1, &["data", "video", "data", "--out", "x"]).contains("is a folder"));
    let before = place.everything();
    let mut command = place.command(&["data", "video", "v.y4m", "--out", "x"]);
    let output = command.env("VSONAR_FFMPEG", "no/ffmpeg").output().expect("started");
    let complaint = one_error(&output, 1);
    assert!(
        complaint.contains("cannot run `no/ffmpeg`") && complaint.contains("install ffmpeg"),
        "{complaint}"
    );
    assert!(before == place.everything());
    if !has_ffmpeg() {
        return;
    }
    for (file, flags, said) in [
        ("text.mp4", &[][..], "Invalid data"),
        ("fps_mode-vsync.mp4", &[], "Invalid data"),
        ("data/labels.csv", &[], "is it a video"),
        ("v.y4m", &["--start", "1000"], "choose an earlier `--start`"),
        ("v.y4m", &["--crop", "0,0,65,20"], "reaches out of the picture, which has 64x48"),
        ("v.y4m", &["--crop", "0,0,10,20"], "10x20 pixels are left"),
    ] {
        let complaint = place.fails(1, &[&["data", "video", file, "--out", "x"], flags].concat());
        assert!(complaint.contains(file) && complaint.contains(said), "{file} {flags:?}: {complaint}");
        assert!(complaint.len() < 600, "{complaint}");
    }
}

/// What a user may have in place of ffmpeg, and how it can fail.
#[cfg(unix)]
mod stand_ins {
    use std::os::unix::fs::PermissionsExt;
    use std::process::Stdio;
    use std::time::{Duration, Instant};

    use super::*;
    use crate::interruption::interrupt;

    fn script(place: &Place, text: &str) {
        place.write("ffmpeg", format!("#!/bin/sh\n{text}\n"));
        let mode = std::fs::Permissions::from_mode(0o755);
        std::fs::set_permissions(place.path("ffmpeg"), mode).expect("writable");
    }

    fn command(place: &Place) -> Command {
        let mut command = place.command(&["data", "video", "v.y4m", "--out", "x"]);
        command.env("VSONAR_FFMPEG", place.path("ffmpeg"));
        command
    }

    #[test]
    fn what_fails_half_way_leaves_nothing_behind() {
        let place = Place::new();
        let whole = y4m(3);
        for (video, text, said) in [
            (
                &whole[..],
                "cat v.y4m; echo broken pipe dream >&2; exit 3",
                "ffmpeg stopped half-way: broken pipe dream",
            ),
            (&whole[..whole.len() - 9], "cat v.y4m", "frame 2: the stream ends after 3063 of its 3072 bytes"),
            (
                &whole[..whole.len() - 9],
                "cat v.y4m; echo out of dreams >&2; exit 1",
                "half-way: out of dreams",
            ),
            (b"nonsense", "cat v.y4m", "there is no frame in it"),
            (b"", "cat v.y4m", "there is no frame in it"),
            (b"", "echo one; exit 1", "ffmpeg cannot read it: it ended with exit status: 1"),
            (&whole[..whole.len() / 4], "head -c 30 v.y4m", "the Y4M header does not end"),
            (b"", "yes a long complaint | head -c 1000000 >&2; exit 1", "a long complaint"),
        ] {
            place.write("v.y4m", video);
            script(&place, text);
            let before = place.everything();
            let output = command(&place).output().expect("started");
            let complaint = one_error(&output, 1);
            assert!(complaint.contains(said) && complaint.len() < 1000, "{text}: {complaint}");
            assert!(before == place.everything(), "{text}");
        }
    }

    /// What it says of what it wrote.
    fn counts(frames: u64, repeated: u64, dropped: u64) -> String {
        format!(
            "printf 'frame={frames}\\ndup_frames={repeated}\\ndrop_frames={dropped}\\nprogress=end\\n' >&2"
        )
    }

    /// An ffmpeg that gives the frames only if it is asked for them in these words, and complains of the others as its
    /// versions do.
    fn version(known: &str, unknown: &[&str]) -> String {
        let refuse = |option: &&str| {
            let name = &option[1..];
            format!(
                "*{option}\\ *) echo \"Unrecognized option '{name}'.\" >&2\n\
                 echo 'Error splitting the argument list: Option not found' >&2; exit 8;;"
            )
        };
        let refusals: Vec<String> = unknown.iter().map(refuse).collect();
        let known = match known {
            "" => String::new(),
            known => format!("*{known}\\ passthrough*-progress*) cat v.y4m; {};;", counts(3, 0, 0)),
        };
        format!("case \"$*\" in\n{}\n{known}\n*) exit 9;;\nesac", refusals.join("\n"))
    }

    #[test]
    fn versions_are_asked_in_their_own_words() {
        let place = Place::new();
        place.write("v.y4m", y4m(3));
        for (known, unknown) in [("-fps_mode", &["-vsync"][..]), ("-vsync", &["-fps_mode"])] {
            script(&place, &version(known, unknown));
            let output = command(&place).output().expect("started");
            let complaint = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success() && complaint.is_empty(), "{known}: {complaint}");
            assert_eq!(taken(&place.path("x")), [0, 1, 2], "{known}");
            std::fs::remove_dir_all(place.path("x")).expect("there");
        }
        script(&place, &version("", &["-vsync", "-fps_mode"]));
        let before = place.everything();
        let complaint = one_error(&command(&place).output().expect("started"), 1);
        assert!(complaint.contains("install a version from 4 on"), "{complaint}");
        assert!(before == place.everything());
    }

    #[test]
    fn frames_are_counted() {
        let place = Place::new();
        place.write("v.y4m", y4m(3));
        for (counted, said) in [
            ((4, 0, 0), "3 frames came, but ffmpeg counts 4 with 0 repeated, and 0 dropped"),
            ((2, 0, 0), "ffmpeg counts 2 "),
            ((3, 2, 0), "ffmpeg counts 3 with 2 repeated, and 0 dropped"),
            ((3, 0, 1), "and 1 dropped"),
        ] {
            let (frames, repeated, dropped) = counted;
            // Earlier counts do not matter.
            let earlier = counts(1, 0, 0);
            script(&place, &format!("{earlier}; cat v.y4m; {}", counts(frames, repeated, dropped)));
            let before = place.everything();
            let complaint = one_error(&command(&place).output().expect("started"), 1);
            assert!(complaint.contains("v.y4m: ") && complaint.contains(said), "{complaint}");
            assert!(before == place.everything(), "{counted:?}");
        }
        script(&place, &format!("{}; cat v.y4m; {}", counts(1, 0, 0), counts(3, 0, 0)));
        assert!(command(&place).output().expect("started").status.success());
        assert_eq!(taken(&place.path("x")), [0, 1, 2]);
    }

    #[test]
    fn ctrl_c_ends_it_and_leaves_nothing_behind() {
        let place = Place::new();
        place.write("v.y4m", y4m(3));
        // It writes some frames and then waits for ever.
        script(&place, "echo $$ >pid; cat v.y4m; exec sleep 1000");
        let run = command(&place).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("started");
        let hidden = place.part_of("x").join("frame_000003.png");
        let start = Instant::now();
        while !hidden.exists() {
            assert!(start.elapsed() < Duration::from_secs(300), "no frame");
            std::thread::sleep(Duration::from_millis(2));
        }
        let ffmpeg: i32 = place.read("pid").trim().parse().expect("a number");
        interrupt(&run);
        let output = run.wait_with_output().expect("it ends");
        let said = String::from_utf8(output.stderr).expect("UTF-8");
        assert_eq!((output.status.code(), said.as_str()), (Some(130), "interrupted; nothing was written\n"));
        assert!(!place.path("x").exists() && !hidden.exists());
        // SAFETY: signal 0 only asks whether the process is there.
        assert_eq!(unsafe { libc::kill(ffmpeg, 0) }, -1, "it still runs");
    }
}
