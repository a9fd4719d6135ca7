"""Address space: one machine (OPC 40001-1) with its results (OPC 40001-101), read-only.

The nodesets of the OPC Foundation are shipped unchanged. Verdicts in words, U, calibrations with
due dates and corrections have no place in them: they are objects of the namespace of this program,
named like the fields of the report.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from typing import Any, get_args

import msgspec
from asyncua import Node, Server, ua
from asyncua.common.instantiate_util import instantiate

from ocmm_core.build import build_version
from ocmm_core.documents import read_text, resource
from ocmm_serve.published import PublishedFacts, PublishedResult, evaluation_of

NAMESPACE = "urn:ocmm:station"
_DI = "http://opcfoundation.org/UA/DI/"
_MACHINERY = "http://opcfoundation.org/UA/Machinery/"
_RESULT = "http://opcfoundation.org/UA/Machinery/Result/"
_FILES = (
    "Opc.Ua.Di.NodeSet2.xml", "Opc.Ua.IA.NodeSet2.xml", "Opc.Ua.Machinery.NodeSet2.xml",
    "Opc.Ua.Machinery_Result.NodeSet2.xml",
)  # fmt: skip
"""In the order of their dependence."""
_MACHINES, _IDENTIFICATION, _ITEM_STATE, _MANAGEMENT, _RESULT_TYPE = 1001, 1012, 1002, 1004, 2001
_META_STRUCTURE, _RESULT_STRUCTURE = 3007, 3008
_STATES = {"NotAvailable": 5005, "OutOfService": 5004, "NotExecuting": 5007, "Executing": 5006}
"""Numbers of nodes in the nodesets."""
_NOT_OFFERED = (
    "AcknowledgeResults", "GetLatestResult", "GetResultById", "GetResultIdListFiltered",
    "ReleaseResultHandle", "ResultTransfer",
)  # fmt: skip
_KINDS = {
    bool: ua.VariantType.Boolean, float: ua.VariantType.Double, int: ua.VariantType.Int32,
    str: ua.VariantType.String,
}  # fmt: skip
# Default values of types of the same file, which do not exist yet.
_DEFAULT = re.compile(r"<Value>\s*<uax:ExtensionObject.*?</Value>", re.DOTALL)
# asyncua 2.1 ignores that a field allows subtypes and writes the bare structure, which clients of
# other makers cannot decode. As i=22, any structure, it is a whole ExtensionObject, as specified.
_SUBTYPED = re.compile(r'DataType="ResultMetaDataType"\s+AllowSubTypes="true"')
_NODE_ID: Any = ua.NodeId
"""Its annotations do not accept plain numbers and texts, which it takes."""
_Leaf = tuple[Any, ua.VariantType]
"""Value and type of a variable; None is shown as BadNoData."""
_Tree = Mapping[str, "_Leaf | _Tree"]


class MachineModel:
    """The machine in an address space; for one event loop."""

    def __init__(self, server: Server) -> None:
        self._server = server
        self._own = self._result = self._machinery = 0
        self._nodes: dict[str, tuple[Node, _Leaf | None]] = {}
        self._results: dict[str, tuple[Node, PublishedResult]] = {}

    async def build(self, name: str, serial: str, uri: str) -> None:
        """Load the nodesets and make the machine; `uri`: globally unique."""
        server = self._server
        for file in _FILES:
            text = read_text(resource("opcua", file))
            text = _SUBTYPED.sub('DataType="i=22"', _DEFAULT.sub("", text))
            await server.import_xml(xmlstring=text)
        self._own = own = await server.register_namespace(NAMESPACE)
        self._result = await server.get_namespace_index(_RESULT)
        await server.load_data_type_definitions()
        await self._state_subtypes()
        self._machinery = machinery = await server.get_namespace_index(_MACHINERY)
        devices = await server.get_namespace_index(_DI)
        machines = server.get_node(_NODE_ID(_MACHINES, machinery))
        machine = await machines.add_object(_NODE_ID("Machine", own), ua.QualifiedName(name, own))
        self._nodes[""] = machine, None
        head = await self._add_in(machine, "Identification", devices, _IDENTIFICATION, machinery)
        for field, value in (
            ("Manufacturer", ua.LocalizedText("OCMM")), ("SerialNumber", serial),
            ("ProductInstanceUri", uri),
        ):  # fmt: skip
            await (await head.get_child(f"{devices}:{field}")).write_value(value)
        software = ua.QualifiedName("SoftwareRevision", devices)
        await head.add_property(_NODE_ID("SoftwareRevision", own), software, build_version())
        blocks = await machine.add_folder(
            _NODE_ID("Blocks", own), ua.QualifiedName("MachineryBuildingBlocks", machinery)
        )
        self._state = await self._add_in(
            blocks, "MachineryItemState", machinery, _ITEM_STATE, machinery
        )
        management = await self._add_in(
            blocks, "ResultManagement", self._result, _MANAGEMENT, self._result
        )
        for one in await management.get_children():
            if (await one.read_browse_name()).Name in _NOT_OFFERED:
                await server.delete_nodes([one], True)
        self._folder = await management.get_child(f"{self._result}:Results")
        # The placeholder of the type.
        await server.delete_nodes(await self._folder.get_children(), True)
        await self.show(PublishedFacts())

    async def _state_subtypes(self) -> None:
        """Give clients the definition of the specification, after asyncua has used the other."""
        node = self._server.get_node(_NODE_ID(_RESULT_STRUCTURE, self._result))
        definition: Any = await node.read_data_type_definition()
        definition.StructureType = ua.StructureType.StructureWithSubtypedValues
        meta = definition.Fields[0]
        meta.DataType, meta.IsOptional = _NODE_ID(_META_STRUCTURE, self._result), True
        value = ua.Variant(definition, ua.VariantType.ExtensionObject)
        await node.write_attribute(ua.AttributeIds.DataTypeDefinition, ua.DataValue(value))

    async def show(self, facts: PublishedFacts) -> None:
        """Show facts in place of those before them."""
        state, latest = facts.state, facts.results[-1:]
        word = "OutOfService" if state.online else "NotAvailable"
        if state.in_service:
            word = "Executing" if state.complete is False else "NotExecuting"
        current = await self._state.get_child("0:CurrentState")
        await current.write_value(ua.LocalizedText(word))
        number = await current.get_child("0:Id")
        await number.write_value(
            ua.Variant(_NODE_ID(_STATES[word], self._machinery), ua.VariantType.NodeId)
        )
        await self._show_results(facts)
        await self._mirror(
            {
                "Station": _tree(state),
                "LatestResult": {} if not latest else _of_result(latest[0]),
                "Calibrations": {f"{one.of} {one.name}": _tree(one) for one in facts.calibrations},
                "Corrections": {one.offset: _tree(one) for one in facts.corrections},
            }
        )

    async def _add_in(
        self, parent: Node, name: str, space: int, kind: int, kind_space: int
    ) -> Node:
        """Add an object by the reference that the specifications require."""
        node = await parent.add_object(
            _NODE_ID(name, self._own), ua.QualifiedName(name, space), _NODE_ID(kind, kind_space),
            kind == _MANAGEMENT,
        )  # fmt: skip
        (given,) = await node.get_references(direction=ua.BrowseDirection.Inverse)
        await parent.delete_reference(node, given.ReferenceTypeId)
        await parent.add_reference(node, ua.ObjectIds.HasAddIn)
        return node

    async def _show_results(self, facts: PublishedFacts) -> None:
        wanted = {one.report.job.uuid: one for one in facts.results}
        for key, (node, shown) in list(self._results.items()):
            if wanted.get(key) != shown:
                await self._server.delete_nodes([node], True)
                del self._results[key]
        for key, result in wanted.items():
            if key not in self._results:
                self._results[key] = await self._add_result(f"Results/{key}", result), result

    async def _add_result(self, path: str, result: PublishedResult) -> Node:
        """Add a result as a variable of the type of the specification, with its parts."""
        value, space = _structure(result), self._result
        node, *_ = await instantiate(
            self._folder, self._server.get_node(_NODE_ID(_RESULT_TYPE, space)),
            _NODE_ID(path, self._own), ua.QualifiedName(result.report.job.name, self._own),
            instantiate_optional=False,
        )  # fmt: skip
        meta = await node.get_child(f"{space}:ResultMetaData")
        number = await meta.get_child(f"{space}:ResultId")
        content = ua.Variant(value.ResultContent, ua.VariantType.Variant)
        await node.add_variable(
            _NODE_ID(f"{path}.ResultContent", self._own), ua.QualifiedName("ResultContent", space),
            content, datatype=_NODE_ID(ua.ObjectIds.BaseDataType),
        )  # fmt: skip
        await node.write_value(value)
        await meta.write_value(value.ResultMetaData)
        await number.write_value(result.report.job.uuid)
        return node

    async def _mirror(self, tree: _Tree) -> None:
        """Make, write and delete nodes until those below the machine are a tree."""
        wanted = dict(_paths(tree, ""))
        for path in [one for one in reversed(self._nodes) if one and one not in wanted]:
            await self._server.delete_nodes([self._nodes.pop(path)[0]], True)
        for path, (parent, name, leaf) in wanted.items():
            node, shown = self._nodes.get(path, (None, None))
            key, title = _NODE_ID(path, self._own), ua.QualifiedName(name, self._own)
            if node is None and leaf is None:
                node = await self._nodes[parent][0].add_object(key, title)
            elif node is None and leaf is not None:
                node = await self._nodes[parent][0].add_variable(
                    key, title, _data(leaf).Value, datatype=_NODE_ID(leaf[1].value)
                )
            if node is not None and leaf is not None and leaf != shown:
                await node.write_value(_data(leaf))
            if node is not None:
                self._nodes[path] = node, leaf


def _data(leaf: _Leaf) -> ua.DataValue:
    value, kind = leaf
    if value is None:
        nothing = ua.Variant(None, ua.VariantType.Null)
        return ua.DataValue(nothing, ua.StatusCode(ua.UInt32(ua.StatusCodes.BadNoData)))
    return ua.DataValue(ua.Variant(value, kind, is_array=isinstance(value, list)))


def _paths(tree: _Tree, parent: str) -> Iterator[tuple[str, tuple[str, str, _Leaf | None]]]:
    """Yield path, parent, name and value of each node, parents first."""
    for name, one in tree.items():
        # Names of characteristics may contain the separator.
        path = f"{parent}/{name.replace('/', '|')}"
        if isinstance(one, tuple):
            yield path, (parent, name, one)
        else:
            yield path, (parent, name, None)
            yield from _paths(one, path)


def _tree(struct: msgspec.Struct) -> dict[str, _Leaf]:
    """Return the fields of a structure that are plain values, or lists of texts."""
    found: dict[str, _Leaf] = {}
    for one in msgspec.structs.fields(struct):
        value, types = getattr(struct, one.name), (one.type, *get_args(one.type))
        name = one.name.title().replace("_", "")
        kinds = [kind for plain, kind in _KINDS.items() if plain in types]
        if one.name.endswith("_utc"):
            found[name] = _moment(value), ua.VariantType.DateTime
        elif isinstance(value, tuple) and kinds == [ua.VariantType.String]:
            found[name] = list(value), kinds[0]
        elif kinds or isinstance(value, str):
            found[name] = value, kinds[0] if kinds else ua.VariantType.String
    return found


def _of_result(result: PublishedResult) -> _Tree:
    report, text = result.report, ua.VariantType.String
    flag, evaluation = ua.VariantType.Boolean, ua.VariantType.Int32
    return {
        **_tree(report.job), "Simulated": (report.simulated, flag),
        "Partial": (result.partial, flag), "PartVerdict": (result.verdict_text, text),
        "Evaluation": (int(result.evaluation), evaluation),
        "Characteristics": {
            one.name: {
                **_tree(one), "Evaluation": (int(evaluation_of(one.verdict)), evaluation),
            }
            for one in report.results
        },
    }  # fmt: skip


def _structure(result: PublishedResult) -> Any:
    """Return a result as the structure of the specification; its content is the report."""
    report = result.report
    kinds: Any = ua  # the classes of the nodesets are made when these are loaded
    meta = kinds.ResultMetaDataType(
        ResultId=report.job.uuid, IsPartial=result.partial, IsSimulated=report.simulated,
        PartId=report.job.serial, ProductId=report.job.part, InternalRecipeId=report.job.plan,
        JobId=report.job.name, CreationTime=_moment(report.job.created_utc),
        ResultEvaluation=kinds.ResultEvaluationEnum(int(result.evaluation)),
        ResultEvaluationDetails=ua.LocalizedText(result.verdict_text), FileFormat=[report.schema],
    )  # fmt: skip
    content = [ua.Variant(result.json.decode("utf-8"), ua.VariantType.String)]
    return kinds.ResultDataType(ResultMetaData=meta, ResultContent=content)


def _moment(text: str) -> datetime | None:
    """Return a time as this protocol has it: UTC, without a zone."""
    return datetime.fromisoformat(text).astimezone(UTC).replace(tzinfo=None) if text else None
