"""Address space: one geometrical measuring system (OPC 40210) with its results, read-only.

The nodesets of the OPC Foundation are shipped unchanged. Verdicts in words, U and reasons have no
place in them: they are in the namespace of this program, named like the fields of the report.
"""

from __future__ import annotations

import asyncio
import re
from collections.abc import Iterable, Mapping
from typing import Any

from asyncua import Node, Server, ua
from asyncua.common.instantiate_util import instantiate

from ocmm_core.build import build_version
from ocmm_core.documents import read_text, resource
from ocmm_serve.opcua._trees import Leaf, Tree, TypedObject, paths_of, structure_of, trees_of
from ocmm_serve.published import PublishedFacts, PublishedResult

NAMESPACE = "urn:ocmm:station"
_SPACES = {
    "di": "http://opcfoundation.org/UA/DI/",
    "machinery": "http://opcfoundation.org/UA/Machinery/",
    "result": "http://opcfoundation.org/UA/Machinery/Result/",
    "tool": "http://opcfoundation.org/UA/MachineTool/",
    "gms": "http://opcfoundation.org/UA/GMS/",
}
_FILES = (
    "Di", "IA", "Machinery", "ISA95_JobControl", "Machinery_Jobs", "Machinery_Result",
    "MachineTool", "GMS",
)  # fmt: skip
"""In the order of their dependence."""
_MACHINES = "machinery:1001"
_ITEM_STATE, _PROGRAM_STATE, _MANAGEMENT = "machinery:1002", "tool:15", "result:1004"
_SYSTEM, _RESULT_TYPE, _PROGNOSES, _TOOLS = "gms:1002", "gms:2004", "tool:2", "tool:44"
_META_STRUCTURE, _RESULT_STRUCTURE = "result:3007", "result:3008"
"""Numbers of nodes in the nodesets."""
_MANUAL = 0
_NOT_OFFERED = (
    "AcknowledgeResults", "GetLatestResult", "GetResultById", "GetResultIdListFiltered",
    "ReleaseResultHandle", "ResultTransfer",
)  # fmt: skip
# Default values of types of the same file, which do not exist yet.
_DEFAULT = re.compile(r"<Value>\s*<uax:ExtensionObject.*?</Value>", re.DOTALL)
# asyncua 2.1 ignores that a field allows subtypes and writes the bare structure, which clients of
# other makers cannot decode. As i=22, any structure, it is a whole ExtensionObject, as specified.
_SUBTYPED = re.compile(r'DataType="ResultMetaDataType"\s+AllowSubTypes="true"')
# This type is not declared in its file; asyncua refuses that.
_UNDECLARED = re.compile(r'DataType="OutputInfoType"')
_NODE_ID: Any = ua.NodeId
"""Its annotations do not accept plain numbers and texts, which it takes."""


class MachineModel:
    """The machine in an address space; for one event loop."""

    def __init__(self, server: Server) -> None:
        self._server = server
        self._spaces = {"0": 0}
        self._roots: dict[str, Node] = {}
        """Nodes that trees are shown below."""
        self._nodes: dict[str, tuple[Node, Leaf | None]] = {}
        self._results: dict[str, tuple[Node, PublishedResult]] = {}

    async def build(self, name: str, serial: str, uri: str) -> None:
        """Load the nodesets and make the machine; `uri`: globally unique."""
        server = self._server
        for file in _FILES:
            text = _DEFAULT.sub("", read_text(resource("opcua", f"Opc.Ua.{file}.NodeSet2.xml")))
            text = _UNDECLARED.sub('DataType="i=7"', _SUBTYPED.sub('DataType="i=22"', text))
            await server.import_xml(xmlstring=text)
        await server.load_data_type_definitions()
        spaces = self._spaces
        spaces[""] = own = await server.register_namespace(NAMESPACE)
        for key, space in _SPACES.items():
            spaces[key] = await server.get_namespace_index(space)
        await self._state_subtypes()
        machine, *_ = await instantiate(
            self._node(_MACHINES), self._node(_SYSTEM), _NODE_ID("Machine", own),
            ua.QualifiedName(name, own), instantiate_optional=False,
        )  # fmt: skip
        head = await self._below(machine, "di:Identification")
        for field, value in (
            ("Manufacturer", ua.LocalizedText("OCMM")), ("SerialNumber", serial),
            ("ProductInstanceUri", uri),
        ):  # fmt: skip
            await (await self._below(head, f"di:{field}")).write_value(value)
        software = self._name("di:SoftwareRevision")
        await head.add_property(_NODE_ID("SoftwareRevision", own), software, build_version())
        mode = await self._below(
            machine, "tool:Monitoring", "tool:MachineTool", "tool:OperationMode"
        )
        await mode.write_value(ua.Variant(_MANUAL, ua.VariantType.Int32))
        program = await self._below(machine, "tool:Production", "tool:ActiveProgram")
        number = await program.get_child("0:NumberInList")
        await number.write_value(ua.Variant(0, ua.VariantType.UInt16))
        self._program = program
        blocks = await machine.add_folder(
            _NODE_ID("Blocks", own), self._name("machinery:MachineryBuildingBlocks")
        )
        self._state = await self._add_in(blocks, "machinery:MachineryItemState", _ITEM_STATE)
        management = await self._add_in(blocks, "result:ResultManagement", _MANAGEMENT)
        for one in await management.get_children():
            if (await one.read_browse_name()).Name in _NOT_OFFERED:
                await server.delete_nodes([one], True)
        self._listed = await self._below(management, "result:Results")
        management = await self._below(machine, "gms:ResultManagement")
        equipment = await self._below(machine, "tool:Equipment")
        notices = await self._below(machine, "tool:Notification")
        self._roots["Machine"] = machine
        for key, parent, title, kind in (
            ("Results", management, "result:Results", None),
            ("Changes", management, "gms:CorrectionsFolder", None),
            ("Tools", equipment, "tool:Tools", _TOOLS),
            ("Prognoses", notices, "tool:Prognoses", _PROGNOSES),
        ):
            made = kind and self._node(kind).nodeid
            self._roots[key] = await parent.add_object(
                _NODE_ID(key, own), self._name(title), made or _NODE_ID(ua.ObjectIds.FolderType)
            )
        for one in (*self._roots.values(), self._listed):
            if one is not machine:
                await self._keep(one, ("0:NodeVersion",))
        await self.show(PublishedFacts())

    def _node(self, text: str) -> Node:
        """Return a node of a nodeset by `gms:NUMBER`."""
        space, _, number = text.partition(":")
        return self._server.get_node(_NODE_ID(int(number), self._spaces[space]))

    def _name(self, text: str) -> ua.QualifiedName:
        space, colon, name = text.partition(":")
        known = self._spaces.get(space) if colon else None
        if known is None:
            return ua.QualifiedName(text, self._spaces[""])
        return ua.QualifiedName(name, known)

    async def _below(self, node: Node, *names: str) -> Node:
        found: Node = await node.get_child([self._name(name) for name in names])
        return found

    async def _state_subtypes(self) -> None:
        """Give clients the definition of the specification, after asyncua has used the other."""
        node = self._node(_RESULT_STRUCTURE)
        definition: Any = await node.read_data_type_definition()
        definition.StructureType = ua.StructureType.StructureWithSubtypedValues
        meta = definition.Fields[0]
        meta.DataType, meta.IsOptional = self._node(_META_STRUCTURE).nodeid, True
        value = ua.Variant(definition, ua.VariantType.ExtensionObject)
        await node.write_attribute(ua.AttributeIds.DataTypeDefinition, ua.DataValue(value))

    async def show(self, facts: PublishedFacts) -> None:
        """Show facts in place of those before them."""
        state = facts.state
        word = "OutOfService" if state.online else "NotAvailable"
        program = "Interrupted" if state.online else ""
        if state.in_service:
            word = "Executing" if state.complete is False else "NotExecuting"
            program = "Ended" if state.complete else "Running" if state.job else "Initializing"
        await self._enter(self._state, _ITEM_STATE, word)
        await self._enter(await self._below(self._program, "tool:State"), _PROGRAM_STATE, program)
        await (await self._below(self._program, "tool:Name")).write_value(state.job)
        await self._show_results(facts)
        await self._mirror(trees_of(facts))

    async def _enter(self, machine: Node, kind: str, word: str) -> None:
        """Write the state of a state machine; empty: unknown."""
        current = await machine.get_child("0:CurrentState")
        text, state, number = None, None, None
        if word:
            node = await self._below(self._node(kind), f"{kind.partition(':')[0]}:{word}")
            text, state = ua.LocalizedText(word), node.nodeid
            number = await (await node.get_child("0:StateNumber")).read_value()
        await current.write_value(_data(Leaf(text, ua.VariantType.LocalizedText)))
        leaves = {
            "Id": Leaf(state, ua.VariantType.NodeId),
            "Number": Leaf(number, ua.VariantType.UInt32),
        }
        # Not every state machine has a number.
        for one in await current.get_properties():
            leaf = leaves.get((await one.read_browse_name()).Name)
            if leaf is not None:
                await one.write_value(_data(leaf))

    async def _add_in(self, parent: Node, name: str, kind: str) -> Node:
        """Add an object by the reference that the specifications require."""
        title = self._name(name)
        node = await parent.add_object(
            _NODE_ID(title.Name, self._spaces[""]), title, self._node(kind).nodeid,
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
        value, own = structure_of(result), self._spaces[""]
        node, *_ = await instantiate(
            self._listed, self._node(_RESULT_TYPE), _NODE_ID(path, own),
            ua.QualifiedName(result.report.job.name, own), instantiate_optional=False,
        )  # fmt: skip
        await self._roots["Results"].add_reference(node, ua.ObjectIds.HasComponent)
        meta = await self._below(node, "result:ResultMetaData")
        number = await self._below(meta, "result:ResultId")
        content = ua.Variant(value.ResultContent, ua.VariantType.Variant)
        await node.add_variable(
            _NODE_ID(f"{path}.ResultContent", own), self._name("result:ResultContent"),
            content, datatype=_NODE_ID(ua.ObjectIds.BaseDataType),
        )  # fmt: skip
        await node.write_value(value)
        await meta.write_value(value.ResultMetaData)
        await number.write_value(result.report.job.uuid)
        return node

    async def _mirror(self, trees: Mapping[str, Tree]) -> None:
        """Make, write and delete nodes until those below the roots are these trees."""
        wanted = {
            path: (parent, name, one)
            for root, tree in trees.items()
            for path, parent, name, one in paths_of(tree, root)
        }
        for path in [one for one in reversed(self._nodes) if one not in wanted]:
            await self._server.delete_nodes([self._nodes.pop(path)[0]], True)
        for path, (parent, name, one) in wanted.items():
            node, shown = self._nodes.get(path, (None, None))
            if node is None:
                node = await self._made(path, parent, name, one)
            leaf = one if isinstance(one, Leaf) else None
            if leaf is not None and leaf != shown:
                await node.write_value(_data(leaf))
            self._nodes[path] = node, leaf
            # Clients read meanwhile.
            await asyncio.sleep(0)

    async def _made(
        self, path: str, parent: str, text: str, one: Leaf | TypedObject | Tree
    ) -> Node:
        """Return a new node, or the member that the type of its parent has made."""
        above = self._roots.get(parent) or self._nodes[parent][0]
        title, key = self._name(text), _NODE_ID(path, self._spaces[""])
        if title.NamespaceIndex != self._spaces[""]:
            made = await self._below(above, text)
        elif isinstance(one, Leaf):
            made = await above.add_variable(
                key, title, _data(one).Value, datatype=_NODE_ID(one.kind.value)
            )
        elif isinstance(one, TypedObject):
            made = await above.add_object(key, title, self._node(one.kind).nodeid, True)
        else:
            made = await above.add_object(key, title)
        if not isinstance(one, Leaf):
            await self._keep(made, one.members if isinstance(one, TypedObject) else one)
        return made

    async def _keep(self, node: Node, members: Iterable[str]) -> None:
        """Delete members that a type has made and nothing fills, also placeholders."""
        wanted = [self._name(name) for name in members]
        for member in await node.get_children():
            if await member.read_browse_name() not in wanted:
                await self._server.delete_nodes([member], True)


def _data(leaf: Leaf) -> ua.DataValue:
    value = leaf.value
    if value is None:
        nothing = ua.Variant(None, ua.VariantType.Null)
        return ua.DataValue(nothing, ua.StatusCode(ua.UInt32(ua.StatusCodes.BadNoData)))
    return ua.DataValue(ua.Variant(value, leaf.kind, is_array=isinstance(value, list)))
