//! Where mesh files are.

use super::Problem;
use std::path::{Path, PathBuf};

/// How far above the URDF file packages are looked for: it may lie deep in its own package, and
/// packages lie side by side.
const LEVELS_UP: usize = 6;

/// Finds mesh files by the names that URDF files give them.
#[derive(Clone, Debug, Default)]
pub(super) struct MeshFinder {
    /// Folder of the URDF file; none for text that came from elsewhere.
    pub(super) folder: Option<PathBuf>,
    pub(super) search_paths: Vec<PathBuf>,
}

impl MeshFinder {
    /// The first existing file a name can mean.
    pub(super) fn find(&self, file: &str) -> Result<PathBuf, Problem> {
        let looked = self.candidates(file).ok_or_else(|| Problem::MeshAddress {
            file: file.to_owned(),
        })?;
        match looked.iter().find(|path| path.is_file()) {
            Some(path) => Ok(path.clone()),
            None => Err(Problem::MeshNotFound {
                file: file.to_owned(),
                looked,
            }),
        }
    }

    /// Every path a name can mean, the likeliest first; none for an address of another kind.
    fn candidates(&self, file: &str) -> Option<Vec<PathBuf>> {
        let paths = self.search_paths.iter().map(PathBuf::as_path);
        let near = self.folder.iter().map(PathBuf::as_path);
        Some(match file.split_once("://") {
            // Some exporters write an empty host, package:///name/rest.
            Some(("package" | "model", rest)) => {
                let rest = rest.trim_start_matches('/');
                let (package, within) = rest.split_once('/').unwrap_or((rest, ""));
                let above = near.flat_map(|folder| folder.ancestors().take(LEVELS_UP));
                paths
                    .chain(above)
                    .flat_map(|folder| in_package(folder, package, within))
                    .collect()
            }
            Some(("file", path)) => vec![PathBuf::from(path)],
            Some(_) => return None,
            None => near.chain(paths).map(|folder| folder.join(file)).collect(),
        })
    }
}

/// A folder may hold the package, or be it.
fn in_package(folder: &Path, package: &str, within: &str) -> impl Iterator<Item = PathBuf> {
    let is_package = folder.file_name().is_some_and(|name| name == package);
    let beside = folder.join(package).join(within);
    core::iter::once(beside).chain(is_package.then(|| folder.join(within)))
}
