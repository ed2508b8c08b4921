//! The files that a scene names.

use std::path::{Path, PathBuf};

use super::{Initial, ParameterSpec, Polygon, Scene, ShapeSpec, SheetSource, path_to};

impl Scene {
    /// Full path of the file that the scene was read from; empty for one that was parsed.
    #[must_use]
    pub fn file(&self) -> &Path {
        &self.file
    }

    /// The meshes, states and fields that the scene names, by key path.
    #[must_use]
    pub fn files(&self) -> Vec<(String, &Path)> {
        let mut files = Vec::new();
        if let SheetSource::File { file } = &self.sheet.source {
            files.push(("sheet.file".to_owned(), file.as_path()));
        }
        if let SheetSource::Generated(ShapeSpec::Polygon(Polygon { outline: Some(file), .. })) =
            &self.sheet.source
        {
            files.push(("sheet.outline".to_owned(), file.as_path()));
        }
        if let Some(material) = &self.material {
            let fields = [("young", &material.young), ("thickness", &material.thickness)];
            let of = fields.into_iter().filter_map(|(key, field)| Some((key, field.file()?)));
            files.extend(of.map(|(key, file)| (format!("material.{key}.file"), file)));
            files.extend(material.drag.file().map(|file| ("material.drag".to_owned(), file)));
        }
        for (k, effect) in self.effects.iter().enumerate() {
            let of = effect.files().into_iter();
            files.extend(of.map(|(key, file)| (format!("effect[{k}].{key}"), file)));
        }
        for (k, kinetics) in self.kinetics.iter().enumerate() {
            let path = self.kinetics_path(k);
            for (name, parameter) in &kinetics.parameters {
                if let ParameterSpec::File(field) = parameter {
                    files.push((path_to(&format!("{path}.parameters"), name), &field.file));
                }
            }
            for (name, initial) in &kinetics.initial {
                if let Initial::File(field) = initial {
                    files.push((path_to(&format!("{path}.initial"), name), &field.file));
                }
            }
        }
        files
    }

    /// Makes all paths absolute: they count from `folder`.
    pub(super) fn resolve_paths_against(&mut self, folder: &Path) {
        let place = |path: &mut PathBuf| *path = folder.join(&path);
        if let SheetSource::File { file } = &mut self.sheet.source {
            place(file);
        }
        if let SheetSource::Generated(ShapeSpec::Polygon(Polygon { outline: Some(file), .. })) =
            &mut self.sheet.source
        {
            place(file);
        }
        if let Some(material) = &mut self.material {
            material.young.resolve_path_against(folder);
            material.thickness.resolve_path_against(folder);
            material.drag.resolve_path_against(folder);
        }
        for effect in &mut self.effects {
            effect.resolve_paths_against(folder);
        }
        for kinetics in &mut self.kinetics {
            for parameter in kinetics.parameters.values_mut() {
                if let ParameterSpec::File(field) = parameter {
                    place(&mut field.file);
                }
            }
            for initial in kinetics.initial.values_mut() {
                if let Initial::File(field) = initial {
                    place(&mut field.file);
                }
            }
            if kinetics.plugin_is_path()
                && let Some(plugin) = &mut kinetics.plugin
            {
                *plugin = folder.join(&*plugin).to_string_lossy().into_owned();
            }
        }
    }
}
