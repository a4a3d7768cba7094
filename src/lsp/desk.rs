//! The texts that are open, and the specs they belong to.
//!
//! In: what is opened, typed and closed, and a way to read the rest. Out: projects, read anew when one of their texts has
//! changed. An open text counts before the file of its name. A file that others use belongs to a spec that uses it.

use super::project::Project;
use super::text::Text;
use crate::design::path_beside;
use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::rc::Rc;

/// More specs that use one file are not looked at.
const MAX_ROOTS: usize = 64;

/// Reads a file that is not open.
pub type Disk = Box<dyn Fn(&str) -> io::Result<String>>;

/// An open text.
#[derive(Debug)]
pub struct Document {
    pub text: Text,
    pub version: i32,
}

pub struct Desk {
    disk: Disk,
    pub open: BTreeMap<String, Document>,
    /// The specs of the workspace, open or not, with what they say of others.
    known: BTreeMap<String, Facts>,
    projects: BTreeMap<String, Rc<Project>>,
}

/// What a text says of other files.
#[derive(Debug, Clone, Default, PartialEq)]
struct Facts {
    has_assembly: bool,
    /// Names of files.
    uses: Vec<String>,
}

impl Desk {
    pub fn new(disk: Disk) -> Desk {
        Desk { disk, open: BTreeMap::new(), known: BTreeMap::new(), projects: BTreeMap::new() }
    }

    /// The specs of the workspace as they are now on disk.
    pub fn know(&mut self, files: Vec<String>) {
        self.projects.clear();
        self.known.clear();
        for name in files {
            let facts = self.text_of(&name).map(|text| Facts::of(&name, &text)).unwrap_or_default();
            self.known.insert(name, facts);
        }
        let open: Vec<String> = self.open.keys().cloned().collect();
        open.iter().for_each(|name| self.learn(name));
    }

    pub fn known(&self) -> impl Iterator<Item = &String> {
        self.known.keys()
    }

    /// The text of a file: the open one, or that on disk.
    pub fn text_of(&self, name: &str) -> io::Result<String> {
        match self.open.get(name) {
            Some(document) => Ok(document.text.as_str().to_string()),
            None => (self.disk)(name),
        }
    }

    pub fn put(&mut self, name: String, text: Text, version: i32) {
        // A file that was missing may be one now.
        self.projects.clear();
        self.open.insert(name.clone(), Document { text, version });
        self.learn(&name);
    }

    /// Changes an open text; `None` if there is none of that name.
    pub fn edit(&mut self, name: &str, version: i32, change: impl FnOnce(&mut Text)) -> Option<()> {
        let document = self.open.get_mut(name)?;
        change(&mut document.text);
        document.version = version;
        self.projects.retain(|_, project| project.file(name).is_none());
        self.learn(name);
        Some(())
    }

    pub fn close(&mut self, name: &str) {
        self.open.remove(name);
        self.projects.clear();
        match (self.disk)(name) {
            Ok(text) => drop(self.known.insert(name.to_string(), Facts::of(name, &text))),
            Err(_) => drop(self.known.remove(name)),
        }
    }

    fn learn(&mut self, name: &str) {
        if let Some(document) = self.open.get(name) {
            self.known.insert(name.to_string(), Facts::of(name, document.text.as_str()));
        }
    }

    /// The specs that a file belongs to: itself if it has an assembly, else those that use it and have one. The open ones
    /// go first.
    pub fn roots(&self, name: &str) -> Vec<String> {
        if self.known.get(name).is_some_and(|facts| facts.has_assembly) {
            return vec![name.to_string()];
        }
        let mut users = self.users(name);
        users.retain(|user| self.known.get(user).is_some_and(|facts| facts.has_assembly));
        users.sort_by_key(|user| (!self.open.contains_key(user), user.clone()));
        users.truncate(MAX_ROOTS);
        if users.is_empty() { vec![name.to_string()] } else { users }
    }

    /// All specs in which a name of this file may stand.
    pub fn readers(&self, name: &str) -> Vec<String> {
        let mut readers = self.roots(name);
        let users = self.users(name).into_iter().filter(|user| self.known.get(user).is_some_and(|f| f.has_assembly));
        for user in users.take(MAX_ROOTS) {
            if !readers.contains(&user) {
                readers.push(user);
            }
        }
        readers
    }

    /// The files that use a file, at first or second hand.
    fn users(&self, name: &str) -> Vec<String> {
        let mut found: BTreeSet<&str> = BTreeSet::new();
        let mut open = vec![name];
        while let Some(next) = open.pop() {
            let direct = self.known.iter().filter(|(_, facts)| facts.uses.iter().any(|used| used == next));
            for (user, _) in direct {
                if user != name && found.insert(user) {
                    open.push(user);
                }
            }
        }
        found.into_iter().map(str::to_string).collect()
    }

    /// The specs of all open texts.
    pub fn all_roots(&self) -> BTreeSet<String> {
        self.open.keys().filter_map(|name| self.roots(name).into_iter().next()).collect()
    }

    /// A spec as it stands now.
    pub fn project(&mut self, root: &str) -> Rc<Project> {
        if let Some(project) = self.projects.get(root) {
            return project.clone();
        }
        let project = Rc::new(Project::new(root, &|name| self.text_of(name)));
        self.projects.insert(root.to_string(), project.clone());
        project
    }

    /// The spec that a file is looked at in, and the file's number there.
    pub fn project_of(&mut self, name: &str) -> Option<(Rc<Project>, u32)> {
        let root = self.roots(name).into_iter().next()?;
        let project = self.project(&root);
        let file = project.file(name)?;
        Some((project, file))
    }
}

impl Facts {
    /// Found by the first words of lines: the text need not parse.
    fn of(name: &str, text: &str) -> Facts {
        let mut facts = Facts::default();
        for line in text.lines().filter(|line| line.starts_with(['a', 'u'])) {
            facts.has_assembly |= line.strip_prefix("assembly").is_some_and(|rest| rest.starts_with([' ', '\t']));
            let used = line.strip_prefix("use").map(str::trim_start).and_then(|rest| rest.strip_prefix('"'));
            facts.uses.extend(used.and_then(|rest| rest.split('"').next()).map(|used| path_beside(name, used)));
        }
        facts
    }
}
