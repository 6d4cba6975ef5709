//! `#[gpu_test]`: a test that needs an adapter.

use proc_macro::{Delimiter, Group, TokenStream, TokenTree};

/// A test that needs an adapter, and passes where there is none.
///
/// ```ignore
/// #[gpu_test]
/// fn gpu_culling_loses_no_light(gpu: &Gpu) {}
/// ```
///
/// is a test without arguments, which takes `gpu`, a `&'static Gpu`, from `testing::gpu("gpu_culling_loses_no_light")`
/// and returns if there is none. It ends when the device is idle. `Gpu` need not be in scope.
///
/// - `#[gpu_test(path)]` takes the adapter from another function of the same signature.
/// - `#[gpu_test(full)]` runs only under `cargo xtask test --full` or by its name; `#[gpu_test(full, path)]` is both. The
///   counterpart for tests without an adapter is `#[ignore = "full"]`.
#[proc_macro_attribute]
pub fn gpu_test(source: TokenStream, function: TokenStream) -> TokenStream {
    let tokens: Vec<TokenTree> = function.into_iter().collect();
    let [head @ .., TokenTree::Ident(name), TokenTree::Group(arguments), TokenTree::Group(body)] = &tokens[..] else {
        panic!("expected `fn name(gpu: &Gpu) {{ … }}`");
    };
    let Some(TokenTree::Ident(gpu)) = arguments.stream().into_iter().next() else {
        panic!("expected one argument, `gpu: &Gpu`");
    };
    let source = source.to_string();
    let (is_full, source) = match source.strip_prefix("full") {
        Some("") => (true, ""),
        Some(rest) if rest.trim_start().starts_with(',') => (true, rest.trim_start()[1..].trim()),
        _ => (false, source.as_str()),
    };
    let source = if source.is_empty() { "testing::gpu" } else { source };
    let adapter = format!(
        "let Some({gpu}) = {source}({:?}) else {{ return }}; let _idle = {gpu}.idle_at_end();",
        name.to_string()
    );
    let mut statements: TokenStream = adapter.parse().expect("this is Rust");
    statements.extend(body.stream());

    let attributes =
        if is_full { r#"#[::core::prelude::v1::test] #[ignore = "full"]"# } else { "#[::core::prelude::v1::test]" };
    let mut test: TokenStream = attributes.parse().expect("this is Rust");
    test.extend(head.iter().cloned());
    test.extend([
        TokenTree::Ident(name.clone()),
        TokenTree::Group(Group::new(Delimiter::Parenthesis, TokenStream::new())),
        TokenTree::Group(Group::new(Delimiter::Brace, statements)),
    ]);
    test
}
