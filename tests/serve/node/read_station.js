// Read everything below the machine of an OPC UA server, and print it as one JSON object.
// node read_station.js URL [CERTIFICATE KEY]
const { OPCUAClient, AttributeIds, NodeClass, MessageSecurityMode, SecurityPolicy } = require("node-opcua-client");

async function main([url, certificateFile, privateKeyFile]) {
    const secure = certificateFile === undefined ? {} : {
        certificateFile, privateKeyFile,
        securityMode: MessageSecurityMode.SignAndEncrypt,
        securityPolicy: SecurityPolicy.Basic256Sha256,
    };
    const client = OPCUAClient.create({
        endpointMustExist: false, connectionStrategy: { maxRetry: 1 }, applicationUri: "urn:ocmm:test", ...secure,
    });
    await client.connect(url);
    const session = await client.createSession();
    const spaces = await session.readNamespaceArray();

    async function read(nodeId) {
        const found = {};
        const { references } = await session.browse({
            nodeId, browseDirection: 0, referenceTypeId: "HierarchicalReferences", includeSubtypes: true, resultMask: 63,
        });
        for (const one of references ?? []) {
            const entry = { type: one.typeDefinition.value, ...{ below: await read(one.nodeId) } };
            if (one.nodeClass === NodeClass.Variable) {
                const data = await session.read({ nodeId: one.nodeId, attributeId: AttributeIds.Value });
                entry.status = data.statusCode.name;
                entry.value = data.value.value;
            }
            found[one.browseName.name] = entry;
        }
        return found;
    }

    const tree = await read(`ns=${spaces.indexOf("urn:ocmm:station")};s=Machine`);
    await session.close();
    await client.disconnect();
    const text = JSON.stringify(tree, (key, value) => (ArrayBuffer.isView(value) ? Array.from(value) : value));
    // `process.exit` would cut a text that is longer than the pipe.
    await new Promise((done) => process.stdout.write(`${text}\n`, done));
}

main(process.argv.slice(2)).then(() => process.exit(0), (error) => {
    console.error(String(error));
    process.exit(1);
});
