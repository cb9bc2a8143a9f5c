"""Sphinx's settings for the HTML manual (scripts/docs). The pages are docs/*.md, as stage.py lays them out."""

project = "Filigree"
copyright = "the authors of Filigree, MIT licence"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
root_doc = "index"
html_theme = "furo"
html_title = "Filigree"
html_show_sourcelink = False
html_copy_source = False
html_static_path = []

# Headings can be linked to as on GitHub.
myst_heading_anchors = 4
myst_enable_extensions = []

# C++ knows no links to std and Eigen here; every other name that is not found is an error of ours.
primary_domain = "cpp"
highlight_language = "text"
autodoc_member_order = "bysource"
autodoc_typehints = "none"
napoleon_numpy_docstring = True
napoleon_google_docstring = False
napoleon_use_rtype = False

# Sphinx before 7.3 works out the id of a declaration at every look at it, which was most of its time here.
import sphinx

if sphinx.version_info < (7, 3):
    from sphinx.domains.cpp import ASTDeclaration

    _work_out_newest_id = ASTDeclaration.get_newest_id

    def _newest_id(declaration):
        if getattr(declaration, "filigree_newest_id", None) is None:
            declaration.filigree_newest_id = _work_out_newest_id(declaration)
        return declaration.filigree_newest_id

    ASTDeclaration.get_newest_id = _newest_id

    # It compares names by all that they have, of every type.
    from sphinx.domains.cpp import ASTIdentifier

    ASTIdentifier.__eq__ = lambda name, other: type(other) is ASTIdentifier and other.identifier == name.identifier
