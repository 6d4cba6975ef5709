//! The files that a linker reads.

use std::{
    borrow::Cow,
    collections::BTreeMap,
    sync::{Mutex, PoisonError},
};

use wesl::{
    Diagnostic, ModulePath, ResolveError, Resolver,
    syntax::{GlobalDeclaration, Ident, PathOrigin, TranslationUnit},
};

use super::{Chosen, Feature, ShaderSource, ShaderTexts};

/// Prefix of imports whose module a feature selects.
const CHOSEN: &str = "package::chosen::";

/// The files of a link: of the package, of its base, and of the packages of chosen modules. The first of a path counts.
pub struct Files<'a> {
    pub lists: Vec<&'static [ShaderSource]>,
    pub texts: &'a ShaderTexts,
    pub features: &'a [Feature],
}

impl Resolver for Files<'_> {
    /// A file's text with `package::chosen::PURPOSE` replaced by the selected modules.
    fn resolve_source<'b>(&'b self, path: &ModulePath) -> Result<Cow<'b, str>, ResolveError> {
        let name = path.components.join("/");
        let file = self.lists.iter().copied().flatten().find(|(path, _)| *path == name);
        let missing = || ResolveError::ModuleNotFound(path.clone(), "no such file".to_owned());
        let (_, text) = file.filter(|_| path.origin == PathOrigin::Absolute).ok_or_else(missing)?;
        let text = self.texts.get(&name).map_or(*text, String::as_str);
        if !text.contains(CHOSEN) {
            return Ok(Cow::Borrowed(text));
        }
        let chosen = self.features.iter().filter_map(|feature| feature.chosen);
        Ok(Cow::Owned(chosen.fold(text.to_owned(), |text, Chosen { purpose, module, .. }| {
            text.replace(&format!("{CHOSEN}{purpose}"), &format!("package::{}", module.replace('/', "::")))
        })))
    }

    /// The same, parsed. Each text is parsed once in a process: parsing took 40 % of the time of a link. With edited texts nothing is kept,
    /// so that nothing grows.
    fn resolve_module(&self, path: &ModulePath) -> Result<TranslationUnit, ResolveError> {
        static PARSED: Mutex<BTreeMap<String, TranslationUnit>> = Mutex::new(BTreeMap::new());
        let text = self.resolve_source(path)?;
        let parse = || text.parse::<TranslationUnit>().map_err(|error| Diagnostic::from(error).into());
        if !self.texts.is_empty() {
            return parse();
        }
        let lock = || PARSED.lock().unwrap_or_else(PoisonError::into_inner);
        let known = lock().get(&*text).cloned();
        let mut parsed = match known {
            Some(parsed) => parsed,
            None => lock().entry(text.to_string()).or_insert(parse()?).clone(),
        };
        // A clone has the names themselves, and the linker renames those of declarations.
        for declaration in &mut parsed.global_declarations {
            let name = match declaration.node_mut() {
                GlobalDeclaration::Declaration(declaration) => &mut declaration.ident,
                GlobalDeclaration::TypeAlias(alias) => &mut alias.ident,
                GlobalDeclaration::Struct(declared) => &mut declared.ident,
                GlobalDeclaration::Function(function) => &mut function.ident,
                GlobalDeclaration::Void | GlobalDeclaration::ConstAssert(_) => continue,
            };
            *name = Ident::new(name.to_string());
        }
        Ok(parsed)
    }
}
