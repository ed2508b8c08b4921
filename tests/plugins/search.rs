//! Plugins by path and by name.

use std::fs;
use std::path::Path;

use rumple::kinetics::{KineticsError, PluginSearch, search};

use super::build::directory;

#[test]
fn a_name_is_looked_up_in_order_with_either_spelling() {
    let first = tempfile::tempdir().unwrap();
    let directories = vec![first.path().to_owned(), directory().to_owned()];
    let search = PluginSearch::in_directories(directories);
    let file = search::file_name("curvature-feedback");
    for name in ["curvature-feedback", "curvature_feedback"] {
        assert_eq!(search.resolve(name, Path::new("/")).unwrap(), directory().join(&file));
    }
    fs::copy(directory().join(&file), first.path().join(&file)).unwrap();
    assert_eq!(
        search.resolve("curvature-feedback", Path::new("/")).unwrap(),
        first.path().join(&file)
    );
}

#[test]
fn a_path_is_relative_to_the_scene() {
    let search = PluginSearch::in_directories(vec![]);
    let file = search::file_name("tension-feedback");
    let below = directory().file_name().unwrap().to_str().unwrap().to_owned() + "/" + &file;
    let scene = directory().parent().unwrap();
    assert_eq!(search.resolve(&below, scene).unwrap(), scene.join(&below));
    assert_eq!(search.resolve(&file, directory()).unwrap(), directory().join(&file));
    let error = search.resolve("./none.so", scene).unwrap_err();
    assert!(matches!(error, KineticsError::MissingFile { .. }), "{error}");
}

#[test]
fn an_unknown_name_lists_what_there_is_and_where() {
    let place = tempfile::tempdir().unwrap();
    for plugin in ["curvature-feedback", "tension-feedback"] {
        let file = search::file_name(plugin);
        fs::copy(directory().join(&file), place.path().join(&file)).unwrap();
    }
    fs::write(place.path().join(search::file_name("other")), "no plugin").unwrap();
    // Misspelt as a path, a part of the name, and its words in another order.
    let path = format!("./{}", search::file_name("curvature-fedback"));
    let nowhere = PluginSearch::in_directories(vec![]);
    let text = nowhere.resolve(&path, place.path()).unwrap_err().to_string();
    let near = search::file_name("curvature-feedback");
    assert!(text.contains("does not exist") && text.contains("did you mean"), "{text}");
    assert!(text.contains(&near), "{text}");
    let there = PluginSearch::in_directories(vec![place.path().to_owned()]);
    for (name, near) in
        [("tension", "tension-feedback"), ("feedback-curvature", "curvature-feedback")]
    {
        let text = there.resolve(name, Path::new("/")).unwrap_err().to_string();
        assert!(text.contains(&format!("did you mean `{near}`?")), "{text}");
    }
    let missing = place.path().join("missing");
    let search = PluginSearch::in_directories(vec![missing.clone(), place.path().to_owned()]);
    let text = search.resolve("curvature-fedback", Path::new("/")).unwrap_err().to_string();
    assert!(text.contains("no plugin `curvature-fedback`"), "{text}");
    assert!(text.contains("did you mean `curvature-feedback`?"), "{text}");
    assert!(text.contains("found: curvature-feedback, tension-feedback\n"), "{text}");
    assert!(text.contains(&missing.display().to_string()), "{text}");
    assert!(text.contains(&place.path().display().to_string()), "{text}");
}

#[test]
fn a_folder_is_told_from_the_library_in_it() {
    let search = PluginSearch::in_directories(vec![]);
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join("growth");
    fs::create_dir_all(folder.join("target/release")).unwrap();
    let text = search.resolve("./growth", place.path()).unwrap_err().to_string();
    assert!(text.contains("growth is a folder") && text.contains("build it first"), "{text}");
    let file = search::file_name("tension-feedback");
    let built = folder.join("target/release").join(&file);
    fs::copy(directory().join(&file), &built).unwrap();
    let error = search.resolve("./growth", place.path()).unwrap_err();
    assert!(matches!(error, KineticsError::Folder { .. }), "{error}");
    let text = error.to_string();
    assert!(text.contains("growth is a folder") && text.contains(&file), "{text}");
}

#[test]
fn an_installed_program_finds_its_plugins_in_lib() {
    let root = tempfile::tempdir().unwrap();
    let (bin, lib) = (root.path().join("bin"), root.path().join(search::INSTALLED));
    fs::create_dir_all(&bin).unwrap();
    fs::create_dir_all(&lib).unwrap();
    let program = bin.join("rumple");
    fs::copy(crate::run::program(), &program).unwrap();
    let file = search::file_name("schnakenberg");
    fs::copy(directory().join(&file), lib.join(&file)).unwrap();
    let out = std::process::Command::new(&program)
        .args(["plugin", "list"])
        .current_dir(root.path())
        .env_clear()
        .output()
        .unwrap();
    let listed = String::from_utf8_lossy(&out.stdout);
    assert!(listed.contains("schnakenberg"), "{listed}");
    assert!(listed.contains(search::INSTALLED), "{listed}");
}
