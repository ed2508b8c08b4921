//! The page that follows a run.

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};

use super::{done, scene};
use crate::run::program;
use crate::run::program::folder;

/// The program, ended with the test.
struct Serving(Child);

impl Drop for Serving {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Serves the results in `out`; the address without scheme and path.
fn serve(folder: &Path) -> (Serving, String) {
    let mut child = Command::new(program())
        .current_dir(folder)
        .args(["view", "out", "--watch"])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut line = String::new();
    BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
    let address = line.split('/').nth(2).unwrap().to_owned();
    assert!(address.starts_with("127.0.0.1:") && line.contains("shows out"), "{line}");
    (Serving(child), address)
}

fn get(address: &str, path: &str) -> String {
    let mut stream = TcpStream::connect(address).unwrap();
    write!(stream, "GET {path} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n").unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    let (head, body) = answer.split_once("\r\n\r\n").unwrap();
    assert!(head.contains("200 OK"), "{head}");
    body.to_owned()
}

#[test]
fn a_page_that_is_served_knows_when_results_have_changed() {
    let folder = folder(&scene());
    let folder = folder.path();
    done(folder, &["run", "scene.toml", "--out", "out", "--quiet"]);
    let (_serving, address) = serve(folder);
    let state = get(&address, "/state");
    let page = get(&address, "/");
    assert!(page.contains("6 of 6 frames") && page.contains("connect-src 'self'"));
    assert!(page.contains(&format!("\"watch\":\"{state}\"")));
    assert_eq!(get(&address, "/state"), state);
    // As a run does that writes on, or takes a frame back.
    let index = fs::read_to_string(folder.join("out/sheet.pvd")).unwrap();
    let fewer: String = index.lines().filter(|line| !line.contains("000005")).collect();
    fs::write(folder.join("out/sheet.pvd"), fewer).unwrap();
    let later = get(&address, "/state");
    assert_ne!(later, state);
    let page = get(&address, "/");
    assert!(page.contains("5 of 5 frames") && page.contains(&later));
    // While a file is written in part there is a word instead, and another try.
    fs::write(folder.join("out/sheet.pvd"), &index[..40]).unwrap();
    let page = get(&address, "/");
    assert!(page.contains("http-equiv=\"refresh\"") && page.contains("sheet.pvd"), "{page}");
    assert_eq!(get(&address, "/other"), "");
}
