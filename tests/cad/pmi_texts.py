"""Small STEP texts with tolerances, written by hand: one face, one bore, one datum."""

from __future__ import annotations

from ocmm_cad.drawing import Account, AccountItem
from ocmm_cad.pmi import Pmi

HEAD = "ISO-10303-21;\nHEADER;\nFILE_SCHEMA(('AP242'));\nENDSEC;\nDATA;\n"
END = "ENDSEC;\nEND-ISO-10303-21;\n"
UNITS = """
#1=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));
#2=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#1);
#3=(CONVERSION_BASED_UNIT('INCH',#2)LENGTH_UNIT()NAMED_UNIT(#9));
#4=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));
#5=PLANE_ANGLE_MEASURE_WITH_UNIT(PLANE_ANGLE_MEASURE(0.0174532925199433),#4);
#6=(CONVERSION_BASED_UNIT('DEGREE',#5)NAMED_UNIT(#9)PLANE_ANGLE_UNIT());
#9=DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.);
"""
FACES = """
#10=PLANE('',#99);
#11=ADVANCED_FACE('',(#98),#10,.T.);
#12=CYLINDRICAL_SURFACE('',#99,6.);
#13=ADVANCED_FACE('',(#98),#12,.T.);
#14=ADVANCED_FACE('',(#98),#12,.T.);
#15=B_SPLINE_SURFACE_WITH_KNOTS('',3,3,((#99)),.UNSPECIFIED.,.F.,.F.,.F.,(4),(4),(0.),(1.),.U.);
#16=ADVANCED_FACE('',(#98),#15,.T.);
#20=PRODUCT_DEFINITION_SHAPE('','',#97);
#21=COMPOSITE_SHAPE_ASPECT('','bore',#20,.T.);
#22=SHAPE_ASPECT('','half',#20,.T.);
#23=SHAPE_ASPECT('','half',#20,.T.);
#24=SHAPE_ASPECT_RELATIONSHIP('',$,#21,#22);
#25=SHAPE_ASPECT_RELATIONSHIP('',$,#21,#23);
#26=GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#22,#96,#13);
#27=GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#23,#96,#14);
#28=SHAPE_ASPECT('','face',#20,.T.);
#29=GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#28,#96,#11);
"""
SIZE = """
#30=DIMENSIONAL_SIZE(#21,'diameter');
#31=DIMENSIONAL_CHARACTERISTIC_REPRESENTATION(#30,#32);
#32=SHAPE_DIMENSION_REPRESENTATION('',(#33),#95);
#33=(LENGTH_MEASURE_WITH_UNIT()MEASURE_REPRESENTATION_ITEM()
MEASURE_WITH_UNIT(LENGTH_MEASURE(12.),#1)REPRESENTATION_ITEM('nominal value'));
#34=PLUS_MINUS_TOLERANCE(#35,#30);
#35=TOLERANCE_VALUE(#36,#37);
#36=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(-0.2),#1);
#37=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(0.1),#1);
#38=DRAUGHTING_CALLOUT('Bore size',());
#39=DRAUGHTING_MODEL_ITEM_ASSOCIATION('PMI representation to presentation link','',#30,#94,#38);
"""
ZONE = """
#40=(GEOMETRIC_TOLERANCE('Place','',#41,#21)GEOMETRIC_TOLERANCE_WITH_DATUM_REFERENCE((#44))
GEOMETRIC_TOLERANCE_WITH_MODIFIERS((.MAXIMUM_MATERIAL_REQUIREMENT.))POSITION_TOLERANCE());
#41=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(0.01),#3);
#42=TOLERANCE_ZONE('',$,#20,.F.,(#40),#43);
#43=TOLERANCE_ZONE_FORM('cylindrical or circular');
#44=DATUM_SYSTEM('',$,#20,.F.,(#45));
#45=DATUM_REFERENCE_COMPARTMENT('',$,#20,.F.,#46,$);
#46=DATUM('',$,#20,.F.,'A');
#47=DATUM_FEATURE('face A',$,#20,.T.);
#48=SHAPE_ASPECT_RELATIONSHIP('',$,#47,#46);
#49=GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#47,#96,#11);
#50=FLATNESS_TOLERANCE('Flat','',#51,#28);
#51=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(0.05),#1);
"""


def text_of(*parts: str, **changes: str) -> str:
    """Return a file with some parts; a change ``_36="..."`` replaces entity #36 or omits it.

    Further entities are added in the same way.
    """
    lines = "".join(parts).replace(");\n", ");\x00").split("\x00")
    entities = {line.strip().partition("=")[0]: line.strip() for line in lines if line.strip()}
    for name, body in changes.items():
        key = "#" + name.removeprefix("_")
        entities.pop(key, None)
        if body:
            entities[key] = f"{key}={body};"
    return HEAD + "\n".join(entities.values()) + "\n" + END


WHOLE = (UNITS, FACES, SIZE, ZONE)


def items_of(account: Account, *groups: str) -> list[AccountItem]:
    return [item for item in account.items if item.group in groups]


def labels_of(pmi: Pmi) -> tuple[int, int, int]:
    """Return the numbers of dimensions, tolerances and datums labelled by the library's reader.

    The library counts one extra dimension for each note and for each label whose leader ends at a
    separate aspect, omits tolerances without a shape, and counts one datum for each reference of a
    tolerance and one for each reference of a datum with targets.
    """
    more = sum(one.own_aspect or not one.shows for one in pmi.annotations)
    shown = [one for one in pmi.tolerances if one.faces or one.odd]
    targets = {one.name: max(1, len(one.targets)) for one in pmi.datums}
    references = sum(
        targets.get(reference.labels[0], 1) if len(reference.labels) == 1
        else len(reference.labels)
        for one in shown
        for reference in one.datums
    )  # fmt: skip
    return len(pmi.dimensions) + more, len(shown), references
