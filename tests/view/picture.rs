//! Pictures and movies, by programs that stand in for browser and ffmpeg; `tests/scripts/view.sh` has the real browser.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;

use super::{done, scene};
use crate::plugins::build;
use crate::run::program;
use crate::run::program::{folder, text};

/// A program of its own, made of the lines of a shell.
fn script(path: PathBuf, lines: &str) -> PathBuf {
    fs::write(&path, format!("#!/bin/sh\n{lines}\n")).unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
    path
}

/// A browser that answers as the page does, and keeps the page that it is given.
fn browser(folder: &Path, answer: &str) -> PathBuf {
    let page = format!("<html><body><pre id=\"pictures\">{answer}</pre></body></html>");
    fs::write(folder.join("answer.html"), page).unwrap();
    let (answer, page) = (folder.join("answer.html"), folder.join("page.html"));
    let lines = format!(
        "for last; do :; done\ncp \"${{last#file://}}\" '{}'\ncat '{}'",
        page.display(),
        answer.display()
    );
    script(folder.join("browser"), &lines)
}

/// A square of one colour as the page hands it over.
fn square(time: f64, colour: [u8; 4]) -> String {
    let mut png = Vec::new();
    let mut encoder = png::Encoder::new(&mut png, 8, 8);
    encoder.set_color(png::ColorType::Rgba);
    encoder.write_header().unwrap().write_image_data(&colour.repeat(64)).unwrap();
    format!("{time} data:image/png;base64,{}", BASE64.encode(png))
}

/// Pixels of a PNG of 8 by 8 pixels.
fn pixels(png: &Path) -> Vec<u8> {
    let file = std::io::BufReader::new(fs::File::open(png).unwrap());
    let mut pixels = vec![0; 256];
    let info = png::Decoder::new(file).read_info().unwrap().next_frame(&mut pixels).unwrap();
    assert_eq!((info.width, info.height), (8, 8));
    pixels
}

fn draw(folder: &Path, args: &[&str]) -> Output {
    Command::new(program())
        .current_dir(folder)
        .env("RUMPLE_PLUGIN_PATH", build::directory())
        .env("RUMPLE_BROWSER", folder.join("browser"))
        .env("RUMPLE_FFMPEG", folder.join("ffmpeg"))
        .args(args)
        .output()
        .unwrap()
}

#[test]
fn pictures_and_movies_are_what_the_page_draws() {
    let folder = folder(&scene());
    let folder = folder.path();
    done(folder, &["run", "scene.toml", "--out", "out", "--quiet"]);
    let (red, blue) = ([255, 0, 0, 255], [0, 0, 255, 255]);
    browser(folder, &square(0.05, red));
    let options = ["--field", "c", "--range=-1,2", "--view=-50,35", "--dpi", "300"];
    let drawn = draw(folder, &[&["picture", "out"], &options[..]].concat());
    assert!(drawn.status.success(), "{}", text(&drawn.stderr));
    assert_eq!(text(&drawn.stdout), "out/picture.png: time 0.05\n");
    assert_eq!(pixels(&folder.join("out/picture.png")), red.repeat(64));
    // What the page was asked for.
    let page = fs::read_to_string(folder.join("page.html")).unwrap();
    for wanted in
        ["\"field\":\"c\"", "\"range\":[-1.0,2.0]", "\"view\":[-50.0,35.0]", "\"movie\":false"]
            .into_iter()
            .chain(["\"size\":[3750,2500]", "\"dpi\":300.0"])
    {
        assert!(page.contains(wanted), "{wanted}");
    }

    browser(folder, &format!("{}\n{}", square(0.0, red), square(0.05, blue)));
    let drawn = draw(folder, &["movie", "out", "--rate", "4"]);
    assert_eq!(text(&drawn.stdout), "out/movie.gif: 2 frames\n", "{}", text(&drawn.stderr));
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let gif = options.read_info(fs::File::open(folder.join("out/movie.gif")).unwrap()).unwrap();
    assert_eq!(gif.repeat(), gif::Repeat::Infinite);
    let frames: Vec<_> = gif.into_iter().map(Result::unwrap).collect();
    let shown: Vec<_> = frames.iter().map(|frame| (frame.delay, &frame.buffer[..4])).collect();
    assert_eq!(shown, [(25, &red[..]), (150, &blue[..])]);

    // ffmpeg reads the pictures one after another, and writes the file that its last argument names.
    script(folder.join("ffmpeg"), "for last; do :; done\ncat > \"$last\"");
    let drawn = draw(folder, &["movie", "out", "-o", "m.mp4"]);
    assert!(drawn.status.success(), "{}", text(&drawn.stderr));
    assert_eq!(pixels(&folder.join("m.mp4")), red.repeat(64));
    // Nothing is left beside the results.
    assert!(!fs::read_dir(folder).unwrap().any(|entry| {
        entry.unwrap().file_name().to_string_lossy().starts_with("rumple-picture")
    }));
}

#[test]
fn pictures_that_cannot_be_drawn_are_refused() {
    let folder = folder(&scene());
    let folder = folder.path();
    done(folder, &["run", "scene.toml", "--out", "out", "--quiet"]);
    browser(folder, "error: no field \"d\"; there are: c &lt;1&gt;");
    script(folder.join("ffmpeg"), "echo no codec >&2; exit 3");
    fs::write(folder.join("there.png"), "mine").unwrap();
    let cases: [(&[&str], &[&str]); 15] = [
        (&["picture", "out", "--field", "d"], &["out: no field \"d\"; there are: c <1>"]),
        (&["picture", "none"], &["none"]),
        (&["picture", "out", "-o", "there.png"], &["there.png", "--force"]),
        (&["picture", "out", "-o", "p.jpg"], &["p.jpg", ".png"]),
        (&["movie", "out", "-o", "m.avi"], &["m.avi", ".gif, .mp4, .webm"]),
        (&["picture", "out", "--size", "20x40"], &["size", "80 to 8192"]),
        (&["picture", "out", "--dpi", "1200"], &["dpi 1200", "80 to 8192", "[15000, 10000]"]),
        (&["picture", "out", "--dpi=-1"], &["dpi -1", "above 0"]),
        (&["picture", "out", "--size", "big"], &["--size", "1200x800"]),
        (&["picture", "out", "--view", "below"], &["view \"below\"", "oblique", "-50,35"]),
        (&["picture", "out", "--view=0,91"], &["-90 to 90"]),
        (&["picture", "out", "--range", "2,1"], &["range 2,1"]),
        (&["picture", "out", "--map", "jet"], &["map \"jet\"", "coolwarm"]),
        (&["picture", "out", "--zoom", "0"], &["zoom 0"]),
        (&["movie", "out", "--rate", "0"], &["rate 0"]),
    ];
    for (args, parts) in cases {
        let drawn = draw(folder, args);
        let message = text(&drawn.stderr);
        assert_eq!(drawn.status.code(), Some(2), "{args:?}: {message}");
        parts.iter().for_each(|part| assert!(message.contains(part), "{args:?}: {message}"));
    }
    assert_eq!(fs::read_to_string(folder.join("there.png")).unwrap(), "mine");

    browser(folder, &square(0.0, [0, 0, 0, 255]));
    let message = text(&draw(folder, &["movie", "out", "-o", "m.webm"]).stderr);
    assert!(message.contains("ffmpeg failed (exit status: 3): no codec"), "{message}");
    assert!(!folder.join("m.webm").exists());
    script(folder.join("browser"), "echo no display >&2; exit 1");
    let message = text(&draw(folder, &["picture", "out"]).stderr);
    assert!(message.contains("drew nothing (exit status: 1): no display"), "{message}");
    let alone = Command::new(program())
        .current_dir(folder)
        .env_remove("RUMPLE_BROWSER")
        .env("PATH", folder.join("none"))
        .args(["picture", "out"])
        .output()
        .unwrap();
    assert!(text(&alone.stderr).contains("rumple paraview"), "{}", text(&alone.stderr));
}
