"""What pyproject.toml cannot say: the folder `resources` is shipped inside a package.

In a checkout it stands at the top, in a wheel it is `ocmm_core/resources`. pyproject.toml either
finds the packages or lists them; here they are found, and this one is added under its other name.
`ocmm_core.documents.resource` looks for it in both places.
"""

from setuptools import find_packages, setup

setup(
    packages=[*find_packages(include=["ocmm_core*", "ocmm_gui*"]), "ocmm_core.resources"],
    package_dir={"ocmm_core.resources": "resources"},
    package_data={
        "ocmm_core": ["py.typed"],
        "ocmm_gui": ["py.typed"],
        "ocmm_core.resources": ["**/*"],
    },
)
