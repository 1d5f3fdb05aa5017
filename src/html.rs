//! Self-contained HTML pages: substitution of `{{name}}` in a template, and the head that all pages
//! have in common.

/// Start of all pages up to the title, inserted for `{{head}}`. The content security policy forbids
/// every network request.
const HEAD: &str = concat!(
    "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n",
    "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n",
    "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; ",
    "style-src 'unsafe-inline'; script-src 'unsafe-inline'\">\n<link rel=\"icon\" href=\"data:,\">\n<style>\n",
    include_str!("html.css"),
    "</style>\n",
);

/// Substitutes each `{{name}}` of the template. Inserted values are not substituted again.
///
/// # Panics
/// If the template has a name that `values` lacks.
#[must_use]
pub fn filled(template: &str, values: &[(&str, &str)]) -> String {
    let mut parts = template.split("{{");
    let mut page = parts.next().unwrap_or_default().to_string();
    for part in parts {
        let (name, rest) = part.split_once("}}").unwrap_or((part, ""));
        let value = values.iter().chain(&[("head", HEAD)]).find(|(n, _)| *n == name);
        page.push_str(value.unwrap_or_else(|| panic!("the page has no {name}")).1);
        page.push_str(rest);
    }
    page
}

/// Escapes text so that it is not parsed as markup.
#[must_use]
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_filled_in_once() {
        let page = filled("<title>{{a}}</title>{{b}}{{a}}", &[("a", "{{b}}"), ("b", "2")]);
        assert_eq!(page, "<title>{{b}}</title>2{{b}}");
        assert!(filled("{{head}}", &[]).contains("prefers-color-scheme: dark"));
    }

    #[test]
    fn text_is_escaped() {
        assert_eq!(escaped("<b a=\"1\">&"), "&lt;b a=&quot;1&quot;&gt;&amp;");
    }
}
