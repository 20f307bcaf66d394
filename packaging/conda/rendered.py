"""Renders the recipe beside this file, and compares it with Cargo.toml. Needs py-rattler-build."""

import pathlib
import tomllib

from rattler_build import Stage0Recipe

here = pathlib.Path(__file__).parent
workspace = tomllib.loads((here / "../../Cargo.toml").read_text())["workspace"]["package"]
for variant in Stage0Recipe.from_file(here / "recipe.yaml").render():
    package = variant.recipe.package
    print(package.name, package.version)
    assert package.version == workspace["version"], "the version in recipe.yaml is not that of Cargo.toml"
    assert variant.recipe.about.license == workspace["license"]
